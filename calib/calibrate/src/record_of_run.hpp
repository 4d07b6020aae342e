// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "calib/calibrate/src/fitted_run.hpp"
#include "calib/calibrate/src/prepared_run.hpp"
#include "calib/fit/cause.hpp"

namespace axiscal {

/// Estimates the scatter due to each cause (blocks, placements of the cube, ...) and adds it to the
/// uncertainty of a fit. A fit by method `magnitude` is not changed. For method `faces`, bias and
/// scale are also computed from the field's magnitude on the six faces.
[[nodiscard]] CountedEstimate counted_scatter(const PreparedRun& run,
                                              const FittedRun& fit,
                                              const SearchedRun& search);

/// Makes the record of a fit, with sensor, statistics, levelness, conditions and uncertainty
/// budget. The record does not yet contain residuals or findings, except for notes.
/// @param counted  the result of counted_scatter(). Its statistics and the contributions of the
///                 uncertain inputs are moved to the record; its other members do not change.
[[nodiscard]] Calibration record_of(const PreparedRun& run,
                                    const ChosenModel& model,
                                    const FittedRun& fit,
                                    CountedEstimate& counted);

}  // namespace axiscal
