// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/fit/estimation.hpp"

namespace axiscal {

/// An axis that reads its largest or smallest value several times, although the prediction lies
/// beyond this value.
struct SaturatedAxis {
  Eigen::Index axis = 0;
  double value = 0.0;     ///< the largest or smallest value of the axis [unit]
  std::vector<int> runs;  ///< run numbers of the readings with this value
};

/// Input of saturated_axes() besides the readings and their fit.
struct SaturationSearch {
  double magnitude = 0.0;    ///< F [field unit]; used only if the fields are not known
  double stated_step = 0.0;  ///< rounding step [unit]; 0: detected from the readings
  /// true: the lowest value of an axis is its reading in darkness, which may repeat
  bool one_sided = false;
};

/// Finds axes that saturate. Such an axis reads its largest or smallest value several times,
/// although the fit of the other readings predicts values beyond it by more than rounding step and
/// noise allow. Rounded readings may also repeat an extreme value by chance, but only clipped
/// readings are clearly short of the prediction.
///
/// Let x be the extreme value of an axis, q its rounding step, and m the number of readings within
/// q / 2 of x. A fit of the other n - m readings gives the mean prediction p for the m readings,
/// and the scatter s of a reading, with s^2 at least q^2 / 12:
///
///     t = (p - x - q / 2) / (s sqrt(g' C g + 1 / m)),   (number of ends) P(T_nu > t) < 0.02
///
/// Here g is the mean row of the design over the m readings, C = (X'X)^-1 for the design X of the
/// other readings, and nu is n - m minus the number of columns. The number of ends is two for each
/// axis, or one for each one-sided axis. If the fields are not known (method `magnitude`), p
/// follows from |f| = F along the measured direction. The square root is then replaced by 1,
/// because such readings are often correlated.
/// @par Source
/// method.md, section 5 (Saturation).
[[nodiscard]] std::vector<SaturatedAxis> saturated_axes(const ReadingSet& set,
                                                        const Estimate& estimate,
                                                        const SaturationSearch& search);

}  // namespace axiscal
