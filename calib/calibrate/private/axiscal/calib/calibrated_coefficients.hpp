// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// As calibrate(), of what a study counts alone: coefficients, their covariance, intervals and
/// uncertainty budget, and the slopes. What merely remarks on the run (residuals of single
/// readings, tests of the slopes, of the field's size and of a bend, warnings, most notes, the
/// status) is not made; half of the time.
/// @throws as calibrate().
[[nodiscard]] Calibration calibrated_coefficients(const Experiment& experiment,
                                                  const Observations& observations);

}  // namespace axiscal
