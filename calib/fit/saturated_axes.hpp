// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/fit/estimation.hpp"

namespace axiscal {

/// An axis that reads its largest or smallest value several times, short of the prediction.
struct SaturatedAxis {
  Eigen::Index axis = 0;
  double value = 0.0;     ///< [unit]
  std::vector<int> runs;  ///< that read so
};

/// Input of saturated_axes() besides the readings and their fit.
struct SaturationSearch {
  double magnitude = 0.0;    ///< of the field [its unit]; for readings without known fields
  double stated_step = 0.0;  ///< of the readings [unit]; 0: as they show it
  bool one_sided = false;    ///< the lowest value is the dark, which repeats as it likes
};

/// Axes that saturate: they read their largest or smallest value several times, although the fit of
/// the other readings predicts values beyond it by more than step and noise allow. Rounded readings
/// repeat an extreme value by chance; clipped ones lie short of the prediction.
///
/// For the m readings within half a step q of the extreme x of an axis, p their mean prediction by
/// the n - m others, of whose fit s^2 is at least q^2 / 12:
///
///     t = (p - x - q / 2) / (s sqrt(g' C g + 1 / m)),   (number of ends) P(T_nu > t) < 0.02
///
/// where g is the mean row of the design over the m readings, C = (X'X)^-1 and nu = n - m - p. Of
/// readings whose fields are not known (method magnitude) p is what |f| = F asks for along the
/// measured direction, and the root is 1, as such readings are often correlated.
/// @par Source
/// method.md, section 5 (Saturation).
[[nodiscard]] std::vector<SaturatedAxis> saturated_axes(const ReadingSet& set,
                                                        const Estimate& estimate,
                                                        const SaturationSearch& search);

}  // namespace axiscal
