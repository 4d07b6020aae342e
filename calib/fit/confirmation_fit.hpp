// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// The result of confirmed(): the comparison, and notes about blocks.
struct ConfirmedReadings {
  Confirmation confirmation;
  std::vector<CalibrationNote> notes;
};

/// Compares readings that were kept out of a fit with the predictions of this fit.
///
/// For a reading of axis k with weight w, the prediction error has the variance s_k^2 / w + J C
/// J^T. Here s_k is the standard deviation of the axis's noise, estimated with nu_k degrees of
/// freedom, J is the row of the reading in the Jacobian, and C is the covariance of the unknowns.
/// The unknowns include the field's direction if it was fitted.
///
/// Each error is compared with an interval from Student's t(nu_k). The mean square of the q errors
/// of an axis is compared with F(q, nu_k), and Fisher's method combines the axes. The noise
/// perpendicular to the field may be larger or smaller than the noise along it. Therefore the test
/// is repeated for several ratios of the two. The p-value is the largest over the ratios that are
/// consistent with the readings of the fit. If a block has no readings in the fit, the
/// shift of its biases is unknown. The test then uses only differences within the block.
///
/// @param fitted       the readings of the fit.
/// @param kept_out     one or more readings, from ReadingSource::kept_out().
/// @param field        the fitted or given field.
/// @param known_field  true if the field was given, not fitted.
/// @throws RefusedError  if the readings of the fit do not determine a prediction.
/// @par Source
/// method.md, section 5.
[[nodiscard]] ConfirmedReadings confirmed(const ReadingSet& fitted,
                                          const ReadingSet& kept_out,
                                          const TableField& field,
                                          bool known_field);

}  // namespace axiscal
