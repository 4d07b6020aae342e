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
/// The direction of the field in the table frame is unknown, so it is fitted (two parameters). The
/// covariance of the residuals has two parts: the noise of the readings, and J C J^T, where C is
/// the covariance of the record's coefficients and J the derivative of the predictions. The
/// residuals of each axis k are tested with the distribution F(q_k, nu_k). q_k is the number of
/// degrees of freedom of these residuals. nu_k is the number of degrees of freedom of the axis's
/// scatter in the record. Fisher's method combines the axes. Only changes of the biases are
/// reported, because the sensitivities are assumed to be unchanged.
///
/// @param experiment    the mount of the instrument in its cube, and the field.
/// @param observations  readings with design points, taken at the record's reference temperature.
///                      Their axes must be those of the record.
/// @throws RefusedError  if the readings do not determine the direction and the biases, if the
///                       readings do not state the face of the cube that touches the fence, if the
///                       unit of the field is not that of the record, or if the record has a field
///                       of several parts, one-sided axes or additional fields.
/// @throws DomainError   if the record states no covariance.
/// @par Source
/// method.md, sections 5 and 8.
[[nodiscard]] AXISCAL_EXPORT DriftCheck check_labelled(const Calibration& record,
                                                       const Experiment& experiment,
                                                       const Observations& observations,
                                                       double alpha = 0.01);

}  // namespace axiscal
