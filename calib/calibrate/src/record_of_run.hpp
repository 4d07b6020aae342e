// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "calib/calibrate/src/fitted_run.hpp"
#include "calib/calibrate/src/prepared_run.hpp"
#include "calib/fit/cause.hpp"

namespace axiscal {

/// Estimates the causes of scatter and adds them to the uncertainty of a fit. Method magnitude is
/// not changed. For method faces, bias and scale are also computed from the lengths of the field.
[[nodiscard]] CountedEstimate counted_scatter(const PreparedRun& run,
                                              const FittedRun& fit,
                                              const SearchedRun& search);

/// Makes the record of a fit, with sensor, statistics, levelness, conditions and uncertainty
/// budget. The record lacks residuals and findings, except for notes on the calibration.
/// @param counted  the result of counted_scatter(). Its statistics and weighed inputs are moved to
///                 the record; its other members do not change.
[[nodiscard]] Calibration record_of(const PreparedRun& run,
                                    const ChosenModel& model,
                                    const FittedRun& fit,
                                    CountedEstimate& counted);

}  // namespace axiscal
