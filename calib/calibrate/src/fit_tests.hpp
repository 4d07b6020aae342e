// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "calib/calibrate/src/fitted_run.hpp"
#include "calib/calibrate/src/prepared_run.hpp"
#include "calib/calibrate/warning_rule.hpp"
#include "calib/fit/cause.hpp"

namespace axiscal {

/// @return the fit with the tests of its levelness and of its lack of fit.
[[nodiscard]] FittedRun tested(const PreparedRun& run, FittedRun fit, const SearchedRun& search);

/// The tests that no part of the uncertainty depends on.
/// @param counted  the estimate of the fit with its uncertainty.
[[nodiscard]] FitTests tests_of(const PreparedRun& run,
                                const FittedRun& fit,
                                const CountedEstimate& counted);

/// Puts into a record the findings of a run: confirmation, check of the field's size, residuals,
/// notes, warnings, suggestion and status.
void judge(const PreparedRun& run,
           const ChosenModel& model,
           const FittedRun& fit,
           const SearchedRun& search,
           const Estimate& estimate,
           const FitTests& tests,
           Calibration& record);

/// Puts the findings on the field into a record of biases.
void judge_biases(const Experiment& experiment, Calibration& record);

}  // namespace axiscal
