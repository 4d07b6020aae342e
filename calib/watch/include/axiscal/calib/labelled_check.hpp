// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// Compares a few labelled readings with the predictions of a record. The readings may be too few
/// for a calibration: three readings are enough to check the record.
///
/// The direction of the field in the table is unknown, so it is fitted (two parameters). The
/// residuals have the covariance of the readings' noise and of the record's coefficients, J C J^T.
/// They are tested axis by axis against F(q_k, nu_k) and combined by Fisher's method. The changes
/// in the report are those of the biases, with constant sensitivities.
///
/// @param experiment    the mount of the instrument in its cube, and the field.
/// @param observations  readings with design points and the axes of the record, at its reference
///                      temperature.
/// @throws RefusedError  if the readings do not determine the direction and the biases, if the
///                       readings lack fence faces, if the unit of the field is not that of the
///                       record, or if the record has a field of several parts, one-sided axes or
///                       second fields.
/// @throws DomainError   if the record states no covariance.
/// @par Source
/// method.md, sections 5 and 8.
[[nodiscard]] AXISCAL_EXPORT DriftCheck check_labelled(const Calibration& record,
                                                       const Experiment& experiment,
                                                       const Observations& observations,
                                                       double alpha = 0.01);

}  // namespace axiscal
