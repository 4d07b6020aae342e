// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/fitted_run.hpp"

#include <algorithm>
#include <array>
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
#include "calib/fit/rounding_scatter.hpp"
#include "calib/fit/temperature_fit.hpp"
#include "calib/record/calibration_warning.hpp"
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

// Copies to `set` the parts of the estimate that later steps need, and stores `set` in the fit.
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

// Also fits the rotation of the instrument in each mount. Rotations and coefficients are fitted
// alternately until the rotations no longer change.
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

FittedRun with_note_of_floor(FittedRun fit) {
  const double floor = fit.source.choice().variance_floor;
  if (floor > 0.0) {
    constexpr double percent = 0.01;
    fit.estimate.notes.push_back(
        {NoteCode::weights,
         formatted("a part of the readings' variance does not decrease with the number of samples "
                   "({} % of the variance at the mean number of samples); the weights include this "
                   "part",
                   number_text(floor / percent, 2))});
  }
  return fit;
}

void require_one_length(const ReadingSet& set) {
  for (const Eigen::Matrix3d& change : set.field_then) {
    constexpr double same = 1e-9;
    if (std::abs(std::cbrt(change.determinant()) - 1.0) > same) {
      throw RefusedError(
          "the method 'magnitude' requires a field of constant magnitude, but the magnitude of "
          "this field changes between readings; give design points");
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
        "two axes turned in a plane measure only the field's component in that plane, but the "
        "magnitude computed from the site is that of the whole field: set the field's magnitude to "
        "that of the component in the plane",
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

// Returns the part of the readings' variance that does not decrease with the number of samples, as
// a fraction of the mean variance. The fraction maximises the likelihood of the residuals of a fit
// with equal weights (method.md, section 4.1). It is 0 if the likelihood hardly increases.
double floor_of_samples(const PreparedRun& run, ChosenModel model) {
  const std::optional<Eigen::VectorXd>& samples = run.observations().samples;
  if (run.weighting() != Weighting::samples || run.experiment().fit.weighting ||
      run.method().by_magnitude || run.experiment().instrument.one_sided ||
      !(samples->minCoeff() < samples->maxCoeff())) {
    return 0.0;
  }
  model.choice.variance_floor = 1.0;
  const FittedRun alike = solve(run, model);
  const auto solution = alike.readings(run.method()).at(alike.estimate.field);
  const auto n = static_cast<Eigen::Index>(alike.source.rows().size());
  Eigen::ArrayXd by_samples = (*samples)(alike.source.rows()).array().inverse();
  by_samples /= by_samples.mean();
  const auto likelihood = [&](double floor) {
    const Eigen::ArrayXd variance = variance_of_samples(floor, by_samples);
    double sum = 0.0;
    for (const AxisSolution& axis : solution->axes) {
      const double squares = (axis.residuals.array().square() / variance).sum();
      sum -= 0.5 * (variance.log().sum() + static_cast<double>(n) * std::log(squares));
    }
    return sum;
  };
  constexpr double clear_gain = 2.0;  // required increase of the log likelihood
  constexpr std::array<double, 6> floors = {0.1, 0.25, 0.5, 0.75, 0.9, 1.0};
  double best = 0.0;
  double highest = likelihood(0.0) + clear_gain;
  for (const double floor : floors) {
    if (const double one = likelihood(floor); one > highest) {
      highest = one;
      best = floor;
    }
  }
  return best;
}

}  // namespace

ChosenModel choose_model(const PreparedRun& run) {
  const TemperatureSetup& setup = run.experiment().fit.temperature;
  ChosenModel model;
  model.choice.effects = {.blocks = true,
                          .drift = run.experiment().fit.drift == DriftSetup::linear};
  model.choice.temperature_reference = setup.reference;
  model.choice.temperature_order = setup.order;
  model.choice.variance_floor = floor_of_samples(run, model);
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

std::optional<ChosenModel> with_mistake_term(const PreparedRun& run,
                                             ChosenModel model,
                                             const SearchedRun& search) {
  if (!search.mistakes.culprit || run.experiment().fit.drift != DriftSetup::automatic) {
    return std::nullopt;
  }
  const Correction& found = search.mistakes.culprit->correction;
  EffectSetup& effects = model.choice.effects;
  const EffectSetup before = effects;
  if (found.code == WarningCode::drift) {
    effects.drift = true;
  } else if (found.code == WarningCode::memory) {
    effects.memory = true;
  } else if (found.code == WarningCode::bias_step && !effects.step_after_run) {
    effects.step_after_run = found.runs.front();
  }
  return effects != before ? std::optional(std::move(model)) : std::nullopt;
}

FittedRun solve(const PreparedRun& run, const ChosenModel& model) {
  if (run.method().by_magnitude) {
    return solved_without_labels(run);
  }
  const ReadingSource source = run.source().with(model.choice);
  const auto solved_by = [&](ReadingSource readings) {
    return with_note_of_floor(with_mounts(run, solved_once(run, std::move(readings))));
  };
  try {
    return solved_by(source);
  } catch (const RefusedError&) {
    ModelChoice without = source.choice();
    if (without.effects == EffectSetup{}) {
      throw;
    }
    without.effects = {};
    return solved_by(source.with(without));
  }
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
  const bool may_be_rounding =
      result.searched &&
      rounding_explains(fit.readings(run.method()), experiment.stated.resolution, fit.estimate);
  if (result.searched && !may_be_rounding) {
    result.mistakes =
        find_culprit(*fit.set, fit.estimate, run.method().directions_known, result.judged.get());
  }
  return result;
}

namespace {

// Returns the coefficients of one effect (for example a drift), one for each axis, as text:
// "x 0.0012, y -0.0003, z 0.0001".
std::string effect_by_axis(const PreparedRun& run,
                           const FittedRun& fit,
                           Eigen::Index effect,
                           double unit = 1.0) {
  std::vector<std::string> changes;
  for (Eigen::Index k = 0; k < fit.estimate.effects.cols(); ++k) {
    changes.push_back(formatted("{} {}",
                                run.experiment().instrument.axes[static_cast<std::size_t>(k)],
                                number_text(fit.estimate.effects(effect, k) / unit, 2)));
  }
  return joined(changes);
}

}  // namespace

std::vector<CalibrationWarning> warnings_of_terms(const PreparedRun& run,
                                                  const FittedRun& fit,
                                                  const SearchedRun& search) {
  std::vector<CalibrationWarning> warnings = search.taken_in;
  const Correction& found = search.mistakes.culprit->correction;
  const RunEffects& effects = fit.set->effects;
  if (found.code == WarningCode::bias_step && effects.step) {
    warnings.push_back(
        {.code = WarningCode::bias_step,
         .runs = found.runs,
         .message = formatted(
             "the biases change in one step between {}, by {} {}. The step is a term of the fit, "
             "and the biases are the means over the run. {}",
             name_of_runs(found.runs), effect_by_axis(run, fit, effects.step_column()),
             run.experiment().instrument.unit, advice_of(found))});
  }
  if (found.code == WarningCode::memory) {
    constexpr double percent = 0.01;
    warnings.push_back(
        {.code = WarningCode::memory,
         .runs = {},
         .message = formatted(
             "each reading lags behind the change since the previous reading (hysteresis), by {} % "
             "of this change. The fit includes a term for this lag. {}",
             effect_by_axis(run, fit, effects.columns.cols() - 1, percent), advice_of(found))});
  }
  return warnings;
}

FittedRun with_note_of_drift(const PreparedRun& run, FittedRun fit) {
  if (!fit.set->effects.has_drift || run.experiment().fit.drift == DriftSetup::linear) {
    return fit;
  }
  const std::string changes = effect_by_axis(run, fit, fit.set->effects.drift_column());
  fit.estimate.notes.push_back(
      {NoteCode::drift,
       formatted("the biases drift over the run, by {} {}. The fit includes a linear drift, and "
                 "the biases in the record are those in the middle of the run. Let the instrument "
                 "warm up before the readings",
                 changes, run.experiment().instrument.unit)});
  return fit;
}

}  // namespace axiscal
