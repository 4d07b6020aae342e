// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "calib/calibrate/src/fitted_run.hpp"
#include "calib/calibrate/src/prepared_run.hpp"
#include "calib/calibrate/warning_rule.hpp"
#include "calib/fit/cause.hpp"

namespace axiscal {

/// Allows for uncertain inputs and for rounding in the tests of the lack of fit. The scatter of the
/// poses, and with it the uncertainty, depends on these tests.
[[nodiscard]] FittedRun with_lack_of_fit(const PreparedRun& run, FittedRun fit);

/// Tests the levelness of the table. The uncertainty does not depend on this test.
[[nodiscard]] FittedRun with_levelness(const PreparedRun& run,
                                       FittedRun fit,
                                       const SearchedRun& search);

/// Tests whether axes are saturated and whether the response is curved. The uncertainty does not
/// depend on these tests.
/// @param counted  the result of counted_scatter().
[[nodiscard]] FitTests tests_of(const PreparedRun& run,
                                const FittedRun& fit,
                                const CountedEstimate& counted);

/// Adds the findings of a run to the record: confirmation, check of the field's magnitude,
/// residuals, notes, warnings, suggestion and status.
void judge(const PreparedRun& run,
           const ChosenModel& model,
           const FittedRun& fit,
           const SearchedRun& search,
           const Estimate& estimate,
           const FitTests& tests,
           Calibration& record);

/// Adds the notes and warnings on the field, and the status, to a record made by method `bias`.
void judge_biases(const Experiment& experiment, Calibration& record);

}  // namespace axiscal
