// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/record_of_run.hpp"

#include <algorithm>
#include <utility>

#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/method_choice.hpp"
#include "calib/fit/face_lengths.hpp"
#include "calib/fit/transfer.hpp"
#include "calib/fit/uncertainty_sources.hpp"
#include "calib/record/parameter_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

double magnitude_of(const PreparedRun& run) {
  return describe_field(run.experiment().table, run.parts()).magnitude;
}

// Copies the fitted vectors of the field's parts to `field`, and the sum of these vectors with all
// parts at level 1.
void put_field(const TableField& fitted, FieldDescription& field) {
  if (!fitted.has_vectors()) {
    field.in_table.reset();  // each reading has its own stated field
    return;
  }
  for (std::size_t p = 0; p < field.parts.size(); ++p) {
    field.parts[p].in_table = fitted.vector(p);
    if (field.parts[p].free_length) {
      field.parts[p].magnitude = fitted.vector(p).norm();
    }
  }
  field.in_table = fitted.mean();
  if (!field.parts.empty()) {
    field.magnitude = field.in_table->norm();
  }
}

void put_temperature(const Estimate& estimate,
                     const ReadingSource& source,
                     const std::vector<TemperatureOrderTrial>& trials,
                     Calibration& calibration) {
  if (!trials.empty()) {
    std::string text;
    for (const TemperatureOrderTrial& trial : trials) {
      text += formatted("{}{} AICc {}", text.empty() ? "order " : ", order ", trial.order,
                        number_text(trial.aicc, 4));
    }
    calibration.findings.notes.push_back(
        {NoteCode::temperature, formatted("temperature terms of order {} were chosen: {}",
                                          estimate.temperature.bias.cols(), text)});
  }
  if (estimate.temperature.bias.cols() == 0) {
    return;
  }
  TemperatureResponse& temperature = calibration.sensor.temperature.emplace();
  temperature.spans = source.temperature_spans();
  temperature.bias = estimate.temperature.bias;
  temperature.scale = estimate.temperature.scale;
  temperature.bias_se = temperature.bias;
  temperature.scale_se = temperature.scale;
  temperature.trials = trials;
}

CalibrationConditions conditions_of(const FittedRun& fit, const CountedEstimate& counted) {
  const BlockEstimate& blocks = counted.estimate.blocks;
  CalibrationConditions conditions;
  conditions.blocks = static_cast<int>(std::max<std::size_t>(fit.set->effects.blocks.size(), 1));
  if (counted.mounts_counted) {
    conditions.mounts = static_cast<int>(fit.source.choice().mounts.size());
  }
  conditions.earlier = blocks.earlier;
  conditions.intermediate =
      conditions.blocks > 1 || conditions.mounts > 1 || conditions.earlier > 0;
  conditions.block_mean_square = blocks.mean_square;
  conditions.block_degrees_of_freedom = blocks.degrees_of_freedom;
  conditions.sensitivity_mean_square = blocks.sensitivity_mean_square;
  conditions.sensitivity_degrees_of_freedom = blocks.sensitivity_degrees_of_freedom;
  return conditions;
}

CalibrationConditions conditions_of_sessions(const Estimate& estimate) {
  CalibrationConditions conditions;
  if (estimate.blocks.sessions > 0) {
    conditions.blocks = estimate.blocks.sessions;
    conditions.intermediate = true;
  }
  return conditions;
}

// Computes bias and scale from the condition that the measured field has the known magnitude on all
// six faces.
void take_face_lengths(const PreparedRun& run, const FittedRun& fit, CountedEstimate& counted) {
  counted.by_lengths = fit_face_lengths(*fit.set, magnitude_of(run), counted.estimate);
  if (!counted.by_lengths && run.experiment().fit.method) {
    throw RefusedError(
        "the method 'faces' requires readings on all six faces, and axes along the cube's edges. "
        "It fits only bias and sensitivity. If the table is level, use the method 'known'",
        {settings::method});
  }
}

}  // namespace

CountedEstimate counted_scatter(const PreparedRun& run,
                                const FittedRun& fit,
                                const SearchedRun& search) {
  const MethodKind& method = run.method();
  if (method.by_magnitude) {
    CountedEstimate counted{.estimate = fit.estimate, .weighed = {}};
    if (fit.estimate.blocks.sessions == 0 && run.experiment().fit.process) {
      counted.estimate.notes.push_back({NoteCode::conditions,
                                        "the method 'magnitude' uses the scatter of earlier "
                                        "calibrations only if the run has several blocks"});
    }
    return counted;
  }
  const SolvedReadings fitted = fit.readings(method);
  const SolvedReadings judged =
      search.judged ? SolvedReadings(*search.judged, method.directions_known) : fitted;
  CountedEstimate counted = count_scatter({.experiment = run.experiment(),
                                           .fitted = fitted,
                                           .judged = judged,
                                           .method = method,
                                           .mounts = fit.source.choice().mounts,
                                           .mounts_expected = fit.mounts_expected,
                                           .has_mistake = search.mistakes.culprit.has_value()},
                                          fit.estimate);
  if (method.by_length) {
    take_face_lengths(run, fit, counted);
  }
  return counted;
}

Calibration record_of(const PreparedRun& run,
                      const ChosenModel& model,
                      const FittedRun& fit,
                      CountedEstimate& counted) {
  Estimate& estimate = counted.estimate;
  Calibration calibration = run.described();
  const MethodKind& method = run.method();
  calibration.fit.conditions =
      method.by_magnitude ? conditions_of_sessions(estimate) : conditions_of(fit, counted);
  if (method.by_magnitude) {
    calibration.fit.shape = run.experiment().fit.shape;
  }
  if (method.by_length && !counted.by_lengths) {
    calibration.fit.method = Method::known;
    note_choice_of_method(run.used(), Method::known, calibration);
  }
  calibration.sensor.response = estimate.response;
  calibration.fit.statistics = std::move(estimate.statistics);
  put_temperature(estimate, fit.source, model.trials, calibration);
  for (std::size_t a = 0; a < estimate.also.size(); ++a) {
    const FieldDescription& also = fit.source.also()[a];
    calibration.sensor.also.push_back({.kind = also.kind,
                                       .unit = also.unit,
                                       .in_table = *also.in_table,
                                       .sensitivity = estimate.also[a],
                                       .sensitivity_se = estimate.also[a]});
  }
  put_field(estimate.field, calibration.sensor.field);
  calibration.sensor.field.in_table_covariance = estimate.direction.covariance;
  calibration.sensor.field.in_table_degrees_of_freedom = estimate.direction.degrees_of_freedom;
  calibration.fit.levelness = estimate.levelness;
  std::vector<LackOfFit>& tests = calibration.fit.statistics->lack_of_fit;
  if (std::none_of(tests.begin(), tests.end(),
                   [](const LackOfFit& test) { return test.pure_error_dof > 0.0; })) {
    tests.clear();
  }
  add_intervals(calibration);
  calibration.fit.uncertainty = make_budget(run.experiment(), *fit.set, calibration, estimate.field,
                                            std::move(counted.weighed));
  if (fit.set->seen.cols() > 0) {
    drop_unobserved_parameters(fit.set->seen, calibration);
  }
  return calibration;
}

}  // namespace axiscal
