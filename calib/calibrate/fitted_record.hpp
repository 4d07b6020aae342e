// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// Calibrates like calibrate(), but without findings, for studies.
/// @return a record with coefficients, covariance, intervals, uncertainty budget and levelness. It
///         lacks residuals, tests, warnings and status.
/// @throws as calibrate().
[[nodiscard]] Calibration fitted_record(const Experiment& experiment,
                                        const Observations& observations);

}  // namespace axiscal
