// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/fit_tests.hpp"

#include <algorithm>
#include <utility>

#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/calib/polar_fit.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "calib/calibrate/src/remarks.hpp"
#include "calib/calibrate/src/run_residuals.hpp"
#include "calib/calibrate/src/temperature_choice.hpp"
#include "calib/fit/confirmation_fit.hpp"
#include "calib/fit/field_size.hpp"
#include "calib/fit/generalized_fit.hpp"
#include "calib/fit/lack_of_fit.hpp"
#include "calib/fit/levelness_test.hpp"
#include "calib/fit/magnitude.hpp"
#include "calib/fit/reading_step.hpp"
#include "calib/fit/rounding_scatter.hpp"

namespace axiscal {
namespace {

SolvedReadings judged_readings(const PreparedRun& run,
                               const FittedRun& fit,
                               const SearchedRun& search) {
  return search.judged ? SolvedReadings(*search.judged, run.method().directions_known)
                       : fit.readings(run.method());
}

void confirm(const PreparedRun& run,
             const FittedRun& fit,
             const SearchedRun& search,
             const Estimate& estimate,
             Calibration& record) {
  const Experiment& experiment = run.experiment();
  if (search.kept_out.size() == 0) {
    return;
  }
  if (run.method().by_magnitude || fit.seen.size() > 0 || fit.set->seen.cols() > 0 ||
      experiment.fit.robust || experiment.fit.level_by == LevelBy::block) {
    throw RefusedError(
        "confirmation readings ('confirm') require design points or known fields that determine "
        "all sensitivities; they cannot be combined with one-sided axes, with one slope of the "
        "table for each block, or with robust regression");
  }
  ConfirmedReadings compared = confirmed(search.judged ? *search.judged : *fit.set, search.kept_out,
                                         estimate.field, run.method().directions_known);
  record.findings.confirmation = std::move(compared.confirmation);
  record.findings.notes.insert(record.findings.notes.end(), compared.notes.begin(),
                               compared.notes.end());
}

// Returns an n x m mask: entry (i, k) is true if the fit of axis k used reading i. The mask has
// a row for each row of the file.
AxisMask used_by_axes(const PreparedRun& run, const FittedRun& fit, const Estimate& estimate) {
  const Observations& observations = run.observations();
  AxisMask used = AxisMask::Constant(observations.size(), observations.response.cols(), false);
  const std::vector<std::size_t>& rows = fit.source.rows();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(rows[i]);
    used.row(row) = fit.source.in_range().row(row);
    if (fit.seen.size() > 0) {
      used.row(row) = used.row(row) && fit.seen.row(static_cast<Eigen::Index>(i));
    }
  }
  for (const std::size_t i : estimate.unpaired) {
    used.row(static_cast<Eigen::Index>(rows[i])).setConstant(false);
  }
  return used;
}

// Returns the fitted responses, without readings to which robust regression gave weight 0.
Eigen::MatrixXd weighed_responses(const FittedRun& fit, const Calibration& record) {
  const Eigen::MatrixXd& robust = record.fit.statistics->robust_weight;
  if (robust.rows() != fit.set->response.rows()) {
    return fit.set->response;
  }
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < robust.rows(); ++i) {
    if (robust.row(i).maxCoeff() > 0.0) {
      kept.push_back(i);
    }
  }
  return fit.set->response(kept, Eigen::all);
}

void put_residuals(const PreparedRun& run,
                   const FittedRun& fit,
                   const Estimate& estimate,
                   Calibration& record) {
  record.fit.residuals =
      residuals_of(run.observations(), fit.source, estimate.field, run.experiment().positioner,
                   record, used_by_axes(run, fit, estimate));
  if (run.method().by_magnitude && record.sensor.instrument.axis_count() == 3) {
    record.fit.orientations = orientation_quality(
        fields_of_readings(record.sensor.response, weighed_responses(fit, record)),
        record.sensor.field.magnitude);
  }
}

// Fits the polar form of the response, which the wind-tunnel literature uses, to the same readings.
// The field is the fitted field. Adds the result to the record for comparison.
void compare_polar_fit(const ReadingSet& set, const TableField& field, Calibration& record) {
  if (record.sensor.temperature || !record.sensor.also.empty() || set.has_excluded_readings() ||
      (!field.has_vectors() && !set.rotation_sensor_from_table.empty())) {
    throw SetupError(
        "the polar fit cannot be used with temperature terms, second fields or excluded readings",
        {settings::polar_fit});
  }
  const Eigen::Matrix<double, Eigen::Dynamic, 3> met = field_design(set, field).middleCols<3>(1);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const int axis = main_axis(record.sensor.instrument, record.sensor.response, k);
    record.fit.polar_fit.push_back(
        fit_polar_form(met, set.response.col(k), axis, record.sensor.instrument.convention));
  }
}

std::vector<int> unpaired_runs(const PreparedRun& run,
                               const FittedRun& fit,
                               const Estimate& estimate) {
  std::vector<int> runs;
  for (const std::size_t i : estimate.unpaired) {
    runs.push_back(run.observations().readings[fit.source.rows()[i]].run);
  }
  return runs;
}

CalibrationStatus status_of(const Calibration& record, const MistakeSearch& mistakes) {
  // Largest permitted effect of a mistake on the coefficients, as a fraction of the full response.
  constexpr double largest_effect = 0.005;
  const std::vector<CalibrationWarning>& warnings = record.findings.warnings;
  const bool refused =
      (mistakes.culprit && mistakes.culprit->effect > largest_effect) ||
      std::any_of(warnings.begin(), warnings.end(), [](const CalibrationWarning& warning) {
        return warning_kind(warning.code).refuses;
      });
  return refused            ? CalibrationStatus::refused
         : warnings.empty() ? CalibrationStatus::ok
                            : CalibrationStatus::warning;
}

// Returns true if rounding of the readings can explain the curvature `bends` of the response.
bool is_within_steps(const PreparedRun& run, const FittedRun& fit, const Eigen::VectorXd& bends) {
  const Eigen::MatrixXd steps =
      detect_rounding_steps(fit.set->response, fit.set->weights, run.experiment().stated.resolution,
                            fit.estimate.statistics.residual_sd);
  return (bends.array().abs() <= steps.colwise().maxCoeff().transpose().array()).all();
}

}  // namespace

FittedRun with_lack_of_fit(const PreparedRun& run, FittedRun fit) {
  if (!run.method().by_magnitude && fit.set->seen.cols() == 0) {
    test_lack_of_fit_of_inputs(run.experiment(), *fit.set, run.method().method, fit.estimate);
    allow_for_rounding(*fit.set, run.experiment().stated.resolution, fit.estimate.statistics);
  }
  return fit;
}

FittedRun with_levelness(const PreparedRun& run, FittedRun fit, const SearchedRun& search) {
  if (!run.method().by_magnitude && fit.set->seen.cols() == 0) {
    test_levelness(judged_readings(run, fit, search), fit.estimate);
  }
  return fit;
}

FitTests tests_of(const PreparedRun& run, const FittedRun& fit, const CountedEstimate& counted) {
  FitTests tests;
  tests.saturated =
      saturated_axes(*fit.set, fit.estimate,
                     {.magnitude = describe_field(run.experiment().table, run.parts()).magnitude,
                      .stated_step = run.experiment().stated.resolution,
                      .one_sided = run.experiment().instrument.one_sided});
  tests.curvature = counted.estimate.curvature;
  if (!run.method().by_magnitude && fit.set->seen.cols() == 0 && !counted.by_lengths) {
    tests.curvature = test_curvature(run.experiment(), fit.readings(run.method()),
                                     run.method().method, counted.estimate);
  }
  if (tests.curvature && is_within_steps(run, fit, tests.curvature->bends)) {
    tests.curvature.reset();
  }
  return tests;
}

void judge(const PreparedRun& run,
           const ChosenModel& model,
           const FittedRun& fit,
           const SearchedRun& search,
           const Estimate& estimate,
           const FitTests& tests,
           Calibration& record) {
  const Experiment& experiment = run.experiment();
  confirm(run, fit, search, estimate, record);
  if (!run.method().by_length) {
    record.fit.field_size = check_field_size(experiment, fit.readings(run.method()),
                                             run.method().method, estimate.field, record);
  }
  put_residuals(run, fit, estimate, record);
  add_notes(record, run.observations(), experiment.positioner);
  note_stated_inputs(experiment.stated.resolution, *fit.set, record);
  if (experiment.fit.compare_polar_fit) {
    compare_polar_fit(*fit.set, estimate.field, record);
  }
  std::vector<CalibrationNote>& notes = record.findings.notes;
  notes.insert(notes.end(), estimate.notes.begin(), estimate.notes.end());
  if (!search.mistakes.remark.empty()) {
    notes.push_back({NoteCode::tails, search.mistakes.remark});
  }
  record.findings.warnings = find_warnings({.calibration = record,
                                            .estimate = estimate,
                                            .tests = tests,
                                            .mistakes = search.mistakes,
                                            .taken_in = search.taken_in,
                                            .searched = search.searched,
                                            .unpaired_runs = unpaired_runs(run, fit, estimate),
                                            .field_varies = run.field_varies()});
  if (!run.field_varies()) {
    remark_on_magnitude(experiment, record);
  }
  note_meaning_of_magnitude(experiment, record);
  warn_of_other_sensitivity(experiment, record);
  if (!model.temperature_has_no_effect && model.choice.temperature_order == 0) {
    warn_of_ignored_temperature(experiment, *fit.set, estimate.field, record);
  }
  if (search.mistakes.culprit) {
    record.findings.suggestion = search.mistakes.culprit->correction;
  }
  record.findings.status = status_of(record, search.mistakes);
}

void judge_biases(const Experiment& experiment, Calibration& record) {
  remark_on_magnitude(experiment, record);
  const std::vector<CalibrationWarning>& warnings = record.findings.warnings;
  const bool refused =
      std::any_of(warnings.begin(), warnings.end(), [](const CalibrationWarning& warning) {
        return warning.code == WarningCode::impossible_field;
      });
  record.findings.status = refused            ? CalibrationStatus::refused
                           : warnings.empty() ? CalibrationStatus::ok
                                              : CalibrationStatus::warning;
}

}  // namespace axiscal
