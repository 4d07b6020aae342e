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
/// unknowns; what is left of the q other numbers has the covariance of the readings' noise and of
/// the record's coefficients, J C J^T, and is held against F(q, nu). The changes that it names are
/// those of the biases, the sensitivities taken as they were.
///
/// @param experiment    how the instrument sits in its cube, and its field.
/// @param observations  with design points, as many axes, at the record's reference temperature.
/// @throws RefusedError  for fewer numbers than the direction and the biases have, a field of
/// several
///                       parts, one-sided axes or second fields.
/// @throws DomainError   if the record states no covariance.
/// @par Source
/// method.md, sections 5 and 8.
[[nodiscard]] DriftCheck check_labelled(const Calibration& record,
                                        const Experiment& experiment,
                                        const Observations& observations,
                                        double alpha = 0.01);

}  // namespace axiscal
