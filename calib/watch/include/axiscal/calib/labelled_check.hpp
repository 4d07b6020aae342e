// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// Holds a few labelled readings, too few for a calibration of their own, against what a record
/// predicts of them: three say whether it still holds.
///
/// The direction of the field in the table is not known from the calibration and is fitted, two
/// unknowns; what is left has the covariance of the readings' noise and of the record's
/// coefficients, J C J^T, and is held axis by axis against F(q_k, nu_k), put together by Fisher's
/// method. The changes that it names are those of the biases, the sensitivities taken as they were.
///
/// @param experiment    how the instrument sits in its cube, and its field.
/// @param observations  with design points, as many axes, at the record's reference temperature.
/// @throws RefusedError  for readings that leave the direction or the biases open, no fence faces,
///                       another unit of the field than the record's, a field of several parts,
///                       one-sided axes or second fields.
/// @throws DomainError   if the record states no covariance.
/// @par Source
/// method.md, sections 5 and 8.
[[nodiscard]] DriftCheck check_labelled(const Calibration& record,
                                        const Experiment& experiment,
                                        const Observations& observations,
                                        double alpha = 0.01);

}  // namespace axiscal
