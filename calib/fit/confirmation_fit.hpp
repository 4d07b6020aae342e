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
/// The prediction error of a reading of axis k has the variance s_k^2 / w + J C J^T. Here s_k is
/// the standard deviation of the axis's noise with nu_k degrees of freedom, w is the weight of the
/// reading, J is its row of the Jacobian, and C is the covariance of the unknowns. If the field's
/// direction was fitted, J includes its tangents. Each error is compared with its own interval from
/// Student's t(nu_k). The q errors of an axis together are compared with F(q, nu_k), and Fisher's
/// method combines the axes. The noise across the field may be larger or smaller than the noise
/// along it; the p-value is the largest over all noise ratios that the readings of the fit do not
/// reject. If a block has no readings in the fit, the shift that its readings share is not
/// compared.
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
