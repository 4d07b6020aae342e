// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/fitted_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/settings.hpp"
#include "calib/calibrate/src/temperature_choice.hpp"
#include "calib/fit/estimate_by_method.hpp"
#include "calib/fit/generalized_fit.hpp"
#include "calib/fit/magnitude.hpp"
#include "calib/fit/mount_turns.hpp"
#include "calib/fit/temperature_fit.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

Eigen::Matrix3d noise_of(const Observations& observations) {
  if (!observations.response_sd || observations.response.cols() != 3 ||
      !(observations.response_sd->array() > 0.0).all()) {
    return Eigen::Matrix3d::Identity();
  }
  return observations.response_sd->cwiseAbs2().colwise().mean().asDiagonal();
}

// Stores the parts of the estimate that later steps need in the readings.
FittedRun completed(FittedRun fit, ReadingSet set) {
  set.seen = fit.estimate.sight.seen;
  set.visible = fit.estimate.sight.visible;
  if (set.temperature.order > 0) {
    set.temperature.scale = fit.estimate.temperature.scale;
    set.temperature.along = fit.estimate.response.sensitivity;
  }
  fit.set = std::make_unique<const ReadingSet>(std::move(set));
  fit.solution = std::move(fit.estimate.solution);
  return fit;
}

FittedRun solved_once(const PreparedRun& run, ReadingSource source) {
  FittedRun fit{.source = std::move(source), .set = nullptr, .estimate = {}, .seen = {}};
  const Method method = run.method().method;
  if (run.experiment().instrument.one_sided) {
    fit.estimate = estimate_one_sided(method, fit.source, run.parts(), fit.seen);
    ReadingSet set = fit.source.set(run.parts(), fit.seen);
    return completed(std::move(fit), std::move(set));
  }
  ReadingSet set = fit.source.set(run.parts(), {});
  fit.estimate = estimate_by(method, set, run.by_field());
  return completed(std::move(fit), std::move(set));
}

// With the turns of the instrument in its mounts, until only the weights of the axes change.
FittedRun with_mounts(const PreparedRun& run, FittedRun fit) {
  if (run.experiment().fit.robust || fit.seen.size() > 0 || fit.set->seen.cols() > 0 ||
      fit.set->temperature.order > 0) {
    return fit;
  }
  constexpr int most_rounds = 8;
  constexpr double still_rad = 1e-9;
  for (int round = 0; round < most_rounds; ++round) {
    const std::optional<MountTurns> mounts =
        fitted_mounts(*fit.set, fit.estimate, run.method().directions_known);
    if (!mounts) {
      return fit;
    }
    ModelChoice choice = fit.source.choice();
    double largest = 0.0;
    for (const auto& [mount, turn] : mounts->turns) {
      largest = std::max(largest, (turn - Eigen::Matrix3d::Identity()).norm());
      const auto found = choice.mounts.try_emplace(mount, Eigen::Matrix3d::Identity()).first;
      found->second = turn * found->second;
    }
    fit = solved_once(run, fit.source.with(std::move(choice)));
    fit.mounts_expected = mounts->expected;
    if (largest < still_rad) {
      break;
    }
  }
  return fit;
}

void require_one_length(const ReadingSet& set) {
  for (const Eigen::Matrix3d& change : set.field_then) {
    constexpr double same = 1e-9;
    if (std::abs(std::cbrt(change.determinant()) - 1.0) > same) {
      throw RefusedError(
          "method magnitude takes the field's magnitude as the same in all readings, but this "
          "field changes its length while they are taken; give design points");
    }
  }
}

FittedRun solved_without_labels(const PreparedRun& run) {
  const Experiment& experiment = run.experiment();
  FittedRun fit{
      .source = run.source().with_complete_rows(), .set = nullptr, .estimate = {}, .seen = {}};
  ReadingSet set = fit.source.set(run.parts(), {});
  require_one_length(set);
  const double F = describe_field(experiment.table, run.parts()).magnitude;
  const bool is_stated = experiment.field.magnitude || experiment.field.kind() == "custom";
  if (set.axis_count() == 2 && !is_stated) {
    throw SetupError(
        "two axes that were turned in a plane meet the part of the field in it alone, and a site "
        "tells the whole: state the length in the plane as the field's magnitude",
        {settings::field_magnitude});
  }
  if (set.axis_count() == 2) {
    fit.estimate = estimate_ellipse(set, F);
    fit.estimate.sight.seen = Eigen::Matrix3d::Identity().leftCols(2);
  } else {
    fit.estimate = estimate_sessions(set, F, experiment.fit.shape, noise_of(run.observations()),
                                     experiment.fit.squares);
  }
  if (!set.rotation_sensor_from_table.empty()) {
    align_by_points(set, F, fit.estimate);
  }
  return completed(std::move(fit), std::move(set));
}

}  // namespace

ChosenModel choose_model(const PreparedRun& run) {
  const TemperatureSetup& setup = run.experiment().fit.temperature;
  ChosenModel model;
  model.choice.effects = {.blocks = true,
                          .drift = run.experiment().fit.drift == DriftSetup::linear};
  model.choice.temperature_reference = setup.reference;
  model.choice.temperature_order = setup.order;
  const bool looks = has_temperatures_enough(run.experiment(), run.observations());
  if (setup.automatic || looks) {
    model.trials = try_orders(run.method().method, run.source(), run.parts(), run.by_field());
    model.choice.temperature_order = chosen_order(model.trials);
  }
  if (looks && !clearly_needed(model.trials)) {
    model.choice.temperature_order = 0;
    model.trials.clear();
    model.temperature_has_no_effect = true;
  }
  return model;
}

ChosenModel with_drift(ChosenModel model) {
  model.choice.effects.drift = true;
  return model;
}

FittedRun solve(const PreparedRun& run, const ChosenModel& model) {
  if (run.method().by_magnitude) {
    return solved_without_labels(run);
  }
  const ReadingSource source = run.source().with(model.choice);
  try {
    return with_mounts(run, solved_once(run, source));
  } catch (const RefusedError&) {
    ModelChoice without = source.choice();
    if (without.effects == EffectSetup{}) {
      throw;
    }
    without.effects = {};
    return with_mounts(run, solved_once(run, source.with(without)));
  }
}

bool SearchedRun::found_drift() const {
  return mistakes.culprit && mistakes.culprit->correction.code == WarningCode::drift;
}

SearchedRun find_mistakes(const PreparedRun& run, const FittedRun& fit) {
  const Experiment& experiment = run.experiment();
  const Method method = run.method().method;
  SearchedRun result;
  if (auto judged = without_shared_errors(experiment, *fit.set, method, fit.estimate, *fit.set)) {
    result.judged = std::make_unique<const ReadingSet>(*std::move(judged));
  }
  result.kept_out = fit.source.kept_out(*fit.set);
  if (result.judged && result.kept_out.size() > 0) {
    result.kept_out =
        *without_shared_errors(experiment, *fit.set, method, fit.estimate, result.kept_out);
  }
  result.searched = experiment.fit.search_for_mistakes && !run.method().by_magnitude &&
                    can_be_searched(*fit.set, fit.estimate);
  if (result.searched) {
    result.mistakes =
        find_culprit(*fit.set, fit.estimate, run.method().directions_known, result.judged.get());
  }
  return result;
}

FittedRun with_note_of_drift(const PreparedRun& run, FittedRun fit) {
  const Eigen::MatrixXd& effects = fit.estimate.effects;
  std::string changes;
  for (Eigen::Index k = 0; k < effects.cols() && fit.set->effects.has_drift; ++k) {
    changes += formatted("{}{} {}", changes.empty() ? "" : ", ",
                         run.experiment().instrument.axes[static_cast<std::size_t>(k)],
                         number_text(effects(effects.rows() - 1, k), 2));  // the last effect
  }
  fit.estimate.notes.push_back(
      {NoteCode::drift,
       formatted("the biases drift over the run, by {} {}; a linear drift is a term of the fit, "
                 "and the biases are those of the middle of the run: let the instrument warm up",
                 changes, run.experiment().instrument.unit)});
  return fit;
}

}  // namespace axiscal
