// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "calib/calibrate/src/fitted_run.hpp"
#include "calib/calibrate/src/prepared_run.hpp"
#include "calib/fit/cause.hpp"

namespace axiscal {

/// Adds the causes of scatter to the uncertainty of a fit, except for method magnitude. For method
/// faces, it also computes bias and scale from the lengths of the field.
[[nodiscard]] CountedEstimate counted_scatter(const PreparedRun& run,
                                              const FittedRun& fit,
                                              const SearchedRun& search);

/// The record of a fit: sensor, statistics, levelness, conditions and uncertainty budget. It lacks
/// residuals and findings, except notes on the calibration.
/// @param counted  the result of counted_scatter(). Its statistics and weighed inputs are moved to
///                 the record; its other members do not change.
[[nodiscard]] Calibration record_of(const PreparedRun& run,
                                    const ChosenModel& model,
                                    const FittedRun& fit,
                                    CountedEstimate& counted);

}  // namespace axiscal
