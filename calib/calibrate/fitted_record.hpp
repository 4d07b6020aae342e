// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// Fits like calibrate(), but does not test the fit or report findings.
/// @return a record with coefficients, covariance, intervals, uncertainty budget and the table's
///         slope (levelness). It lacks residuals, tests, warnings and status.
/// @throws as calibrate().
[[nodiscard]] Calibration fitted_record(const Experiment& experiment,
                                        const Observations& observations);

}  // namespace axiscal
