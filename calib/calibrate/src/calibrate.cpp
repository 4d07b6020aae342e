// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibrate.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "axiscal/calib/calibrate_run.hpp"
#include "axiscal/core/error.hpp"
#include "calib/calibrate/fitted_record.hpp"
#include "calib/calibrate/src/fit_tests.hpp"
#include "calib/calibrate/src/fitted_run.hpp"
#include "calib/calibrate/src/prepared_run.hpp"
#include "calib/calibrate/src/record_of_run.hpp"
#include "calib/calibrate/src/repeated_readings.hpp"
#include "calib/calibrate/src/unsettled_readings.hpp"
#include "calib/calibrate/warning_rule.hpp"
#include "calib/fit/bias_fit.hpp"
#include "calib/fit/uncertainty_sources.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Estimates only the biases, from readings at rest in one pose.
Calibration calibration_of_biases(const PreparedRun& run) {
  const std::vector<Reading>& readings = run.observations().readings;
  if (std::any_of(readings.begin(), readings.end(),
                  [](const Reading& reading) { return reading.confirm; })) {
    throw RefusedError("the method 'bias' does not support confirmation readings ('confirm')");
  }
  Calibration record = run.described();
  fit_bias(run.experiment(), run.observations(), run.source(), record);
  record.fit.uncertainty = make_budget(run.experiment(), {}, record, {}, {});
  judge_biases(run.experiment(), record);
  return record;
}

// The model that was chosen for a run, its fit, and the search for mistakes.
struct SolvedRun {
  ChosenModel model;
  FittedRun fit;
  SearchedRun search;
};

SolvedRun solved(const PreparedRun& run) {
  ChosenModel model = choose_model(run);
  FittedRun fit = solve(run, model);
  SearchedRun search = find_mistakes(run, fit);
  while (const std::optional<ChosenModel> extended = with_mistake_term(run, model, search)) {
    FittedRun refit = solve(run, *extended);
    const FitStatistics& statistics = refit.estimate.statistics;
    const double largest_condition =
        std::max(largest_good_condition, 2.0 * fit.estimate.statistics.condition_number);
    if (refit.source.choice().effects != extended->choice.effects ||
        !(statistics.degrees_of_freedom.minCoeff() > 0.0) ||
        statistics.condition_number > largest_condition) {
      break;  // the readings hardly determine the term, or no degrees of freedom are left
    }
    SearchedRun again = find_mistakes(run, refit);
    again.taken_in = warnings_of_terms(run, refit, search);
    model = *extended;
    fit = with_note_of_drift(run, std::move(refit));
    search = std::move(again);
  }
  return {.model = std::move(model), .fit = std::move(fit), .search = std::move(search)};
}

Calibration calibrated(const Experiment& experiment, const Observations& observations);

// Calibrates without the readings in `rows`. Adds `reasons`, which state why these readings are
// left out, to the warnings.
Calibration calibrated_without(const Experiment& experiment,
                               const Observations& observations,
                               const std::vector<std::size_t>& rows,
                               std::vector<CalibrationWarning> reasons) {
  const std::set<std::size_t> left_out(rows.begin(), rows.end());
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    if (left_out.count(i) == 0) {
      kept.push_back(i);
    }
  }
  Calibration record = calibrated(experiment, select_rows(observations, kept));
  std::vector<CalibrationWarning>& warnings = record.findings.warnings;
  const std::vector<CalibrationWarning> others = std::exchange(warnings, {});
  for (CalibrationWarning& reason : reasons) {
    add_warning(record, std::move(reason));
  }
  warnings.insert(warnings.end(), others.begin(), others.end());
  return record;
}

Calibration calibrated(const Experiment& experiment, const Observations& observations) {
  const PreparedRun run(experiment, observations);  // checks the inputs, chooses the method
  if (!run.method().fits_sensitivity) {
    return calibration_of_biases(run);
  }
  if (std::optional<UnsettledReadings> unsettled = find_unsettled(run)) {
    return calibrated_without(experiment, observations, unsettled->rows, {unsettled->warning});
  }
  auto [model, fit, search] = solved(run);  // method.md, sections 4 to 6
  if (const auto repeats = find_repeats(run, fit); !repeats.empty()) {
    return calibrated_without(experiment, observations, duplicate_rows(repeats),
                              warnings_of(repeats, observations));
  }
  fit = with_levelness(run, with_lack_of_fit(run, std::move(fit)), search);
  CountedEstimate counted = counted_scatter(run, fit, search);      // method.md, section 4.1
  const FitTests tests = tests_of(run, fit, counted);               // saturation, curvature
  Calibration record = record_of(run, model, fit, counted);         // method.md, section 8
  judge(run, model, fit, search, counted.estimate, tests, record);  // method.md, section 5
  return record;
}

// Adds a note to a refused calibration if robust regression succeeds by giving a few readings the
// weight 0.
void note_robust_fit(const Experiment& experiment,
                     const Observations& observations,
                     Calibration& refused) {
  const MethodKind& method = method_kind(*refused.fit.method);
  if (experiment.fit.robust || experiment.fit.squares || !method.fits_sensitivity) {
    return;
  }
  Experiment robust = experiment;
  robust.fit.robust = true;
  robust.fit.search_for_mistakes = false;
  robust.fit.method = method.averages_pairs ? Method::joint : method.method;
  try {
    const Calibration found = calibrated(robust, observations);
    const FitStatistics& statistics = *found.fit.statistics;
    std::vector<int> runs;
    for (Eigen::Index i = 0; i < statistics.robust_weight.rows(); ++i) {
      if (statistics.robust_weight.row(i).minCoeff() == 0.0) {
        const std::vector<int>& own = statistics.rows[static_cast<std::size_t>(i)].runs;
        runs.insert(runs.end(), own.begin(), own.end());
      }
    }
    constexpr std::size_t few = 5;
    if (found.findings.status != CalibrationStatus::refused && !runs.empty() &&
        runs.size() <= few) {
      refused.findings.notes.push_back(
          {NoteCode::weights,
           formatted(
               "robust regression ignores {} (weight 0) and then agrees with all other readings",
               name_of_runs(runs))});
    }
  } catch (const Error&) {  // robust regression cannot help
    return;
  }
}

}  // namespace

Calibration calibrate(const Experiment& experiment, const Observations& observations) {
  Calibration record = calibrated(experiment, observations);
  if (record.findings.status == CalibrationStatus::refused) {
    note_robust_fit(experiment, observations, record);
  }
  return record;
}

Calibration fitted_record(const Experiment& experiment, const Observations& observations) {
  const PreparedRun run(experiment, observations);
  if (!run.method().fits_sensitivity) {
    return calibration_of_biases(run);
  }
  auto [model, fit, search] = solved(run);
  fit = with_lack_of_fit(run, std::move(fit));
  CountedEstimate counted = counted_scatter(run, fit, search);
  return record_of(run, model, fit, counted);
}

Calibration calibrate(const Experiment& experiment,
                      std::span<const DesignPoint> points,
                      const Eigen::Ref<const Eigen::MatrixXd>& response) {
  return calibrate(experiment, make_run(points, response).observations);
}

Calibration calibrate(const Run& run, Instrument instrument, FieldSetup field, Force force) {
  Experiment experiment;
  experiment.instrument = std::move(instrument);
  experiment.field = std::move(field);
  const bool any_axes = experiment.instrument.axes == Instrument().axes;
  if (any_axes && !run.axes.empty()) {
    experiment.instrument.axes = run.axes;
  }
  if (!run.slots.empty() || has_several_units(run)) {
    throw SetupError("the run is of several instruments: use calibrate_run() or split_by_serial()");
  }
  Calibration calibration = calibrate_run(std::move(experiment), run).front();
  require_unrefused(calibration, force);
  return calibration;
}

}  // namespace axiscal
