// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// calibrate() without its findings, for studies: coefficients, covariance, intervals, uncertainty
/// budget and slopes. Residuals, tests, warnings and status are left out.
/// @throws as calibrate().
[[nodiscard]] Calibration fitted_record(const Experiment& experiment,
                                        const Observations& observations);

}  // namespace axiscal
