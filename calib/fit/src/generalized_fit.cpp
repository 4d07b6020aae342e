// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/generalized_fit.hpp"

#include <optional>
#include <utility>

#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/fit/input_quantities.hpp"
#include "calib/fit/layings.hpp"
#include "calib/fit/rounding_scatter.hpp"
#include "calib/fit/src/components_fit.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The smallest number of layings whose means alone separate rotations of the cube from noise. Fewer
// layings are enough if the scatter of their readings shows the noise.
constexpr Eigen::Index fewest_layings = 24;

// Returns true if the fit includes random rotations of the cube at its seats.
bool looks_for_seats(const Experiment& experiment,
                     const ReadingSet& set,
                     const MeanReadings& layings,
                     const Estimate& estimate) {
  constexpr Eigen::Index fewest_repeated = 12;
  constexpr double enough_within = 12.0;
  constexpr Eigen::Index most = 2000;  // nobody places a cube more often in one calibration
  if (experiment.fit.seats == SeatSetup::none || experiment.fit.robust ||
      !estimate.field.has_vectors() || set.axis_count() < 2 || set.field.is_sum()) {
    return false;
  }
  // If the readings are coarsely rounded, rotations at the seats cannot be distinguished from
  // rounding errors.
  return experiment.fit.seats == SeatSetup::fit ||
         (layings.set().size() >= (layings.degrees_of_freedom.minCoeff() >= enough_within
                                       ? fewest_repeated
                                       : fewest_layings) &&
          layings.set().size() <= most &&
          !is_coarsely_rounded(set, experiment.stated.resolution, estimate.statistics.residual_sd));
}

// Returns the layings without the scatter of their readings, if the readings of a laying share an
// error besides the cube's rotation: only the means are then independent. Returns nullopt if they
// share no such error.
std::optional<MeanReadings> means_alone(const MeanReadings& layings,
                                        const SolvedReadings& run,
                                        const std::vector<InputQuantity>& inputs,
                                        const Estimate& estimate) {
  constexpr double fewest_within = 6.0;
  if (layings.degrees_of_freedom.minCoeff() < fewest_within ||
      !(layings.squares.minCoeff() > 0.0)) {
    return std::nullopt;
  }
  MeanReadings alone = layings;
  alone.forget_scatter();
  ComponentsFit fit(alone, run, inputs, true, estimate);
  return fit.solve() && fit.exceeds_scatter_within(layings) ? std::optional(std::move(alone))
                                                            : std::nullopt;
}

// Returns true if shared errors can be estimated. This requires that the design points determine
// the fields, that all axes are in the same field, and that the readings determine all
// coefficients.
bool can_weigh(const ReadingSet& set, const Estimate& estimate) {
  return estimate.field.has_vectors() && !set.rotation_sensor_from_table.empty() &&
         set.visible.empty() && set.seen.cols() == 0;
}

}  // namespace

std::optional<CurvatureTest> test_curvature(const Experiment& experiment,
                                            const SolvedReadings& run,
                                            Method method,
                                            const Estimate& estimate) {
  const ReadingSet& set = run.set();
  const FitStatistics& statistics = estimate.statistics;
  if (!can_weigh(set, estimate) || experiment.fit.robust ||
      !(statistics.residual_sd.array() > 0.0).all()) {
    return std::nullopt;
  }
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    if (statistics.residual_sd(k) <= 2.0 * set.rounding(k)) {
      return std::nullopt;  // rounding errors can look like curvature
    }
  }
  // If all readings of a pose share an error, only the means of the poses are independent.
  const bool has_poses = statistics.find_component("poses") != nullptr;
  MeanReadings means = has_poses ? average_poses(set, estimate) : average_layings(set, estimate);
  if (statistics.find_component("layings") != nullptr) {
    means.forget_scatter();  // only the means are independent
  }
  const bool known = method_kind(method).directions_known;
  const std::vector<InputQuantity> inputs =
      input_quantities(experiment, means.set(), known, estimate.field);
  const bool seats = !has_poses && statistics.find_component("seats") != nullptr;
  SolvedReadings of_means(means.set(), known);
  return ComponentsFit(means, means.own ? of_means : run, inputs, seats, estimate).curvature();
}

std::optional<ReadingSet> without_shared_errors(const Experiment& experiment,
                                                const ReadingSet& set,
                                                Method method,
                                                const Estimate& estimate,
                                                const ReadingSet& of) {
  if (!can_weigh(set, estimate) || experiment.fit.robust) {
    return std::nullopt;
  }
  const bool known = method_kind(method).directions_known;
  const std::vector<InputQuantity> own = input_quantities(experiment, of, known, estimate.field);
  if (own.empty()) {
    return std::nullopt;
  }
  const MeanReadings layings = average_layings(set, estimate);
  const std::vector<InputQuantity> inputs =
      input_quantities(experiment, layings.set(), known, estimate.field);
  SolvedReadings of_layings(layings.set(), known);
  ComponentsFit fit(layings, of_layings, inputs, false, estimate);
  if (!fit.solve()) {
    return std::nullopt;
  }
  ReadingSet without = of;
  without.response -= fit.shared_parts(of, own);
  return without;
}

std::vector<UncertaintySource> weigh_shared_errors(const Experiment& experiment,
                                                   const SolvedReadings& run,
                                                   Method method,
                                                   Estimate& estimate) {
  const ReadingSet& set = run.set();
  const bool known = method_kind(method).directions_known;
  if (!can_weigh(set, estimate)) {
    return {};
  }
  const MeanReadings layings = average_layings(set, estimate);
  const std::vector<InputQuantity> inputs =
      input_quantities(experiment, layings.set(), known, estimate.field);
  const bool has_normals = !inputs.empty() && inputs.front().name == "positioner";
  if (experiment.fit.robust) {
    if (has_normals) {
      estimate.notes.push_back({NoteCode::face_normals,
                                "robust regression ignores the uncertainty of the cube's face "
                                "normals, so the stated uncertainties do not include it"});
    }
    return {};
  }
  SolvedReadings of_layings(layings.set(), known);
  for (const bool seats : {true, false}) {
    const bool shared =
        seats ? looks_for_seats(experiment, set, layings, estimate) : !inputs.empty();
    if (!shared) {
      continue;
    }
    const SolvedReadings& means = layings.own ? of_layings : run;
    const std::optional<MeanReadings> alone =
        seats ? means_alone(layings, means, inputs, estimate) : std::nullopt;
    if (alone && layings.set().size() < fewest_layings) {
      continue;
    }
    ComponentsFit fit(alone ? *alone : layings, means, inputs, seats, estimate);
    const bool may_be_nothing = seats && experiment.fit.seats != SeatSetup::fit;
    // The seats' variance must be more than 1.6 times its standard error, which corresponds to 5
    // degrees of freedom. A smaller variance may be chance, and would reduce the estimate of the
    // noise.
    constexpr double enough = 5.0;
    constexpr double nearly_enough = 0.9 * enough;
    if ((may_be_nothing && !fit.may_see_seats()) ||
        !fit.solve(may_be_nothing ? nearly_enough : 0.0) || (seats && !fit.sees_seats(enough))) {
      continue;
    }
    fit.put(estimate);
    if (alone) {
      fit.put_errors_of(layings, estimate);
    }
    // Seats are mentioned in a note only if their variance is 2.9 times its standard error or more,
    // which corresponds to 17 degrees of freedom. The intervals include smaller variances without a
    // note.
    constexpr double clear = 17.0;
    if (seats && (!may_be_nothing || fit.sees_seats(clear))) {
      estimate.notes.push_back(
          {NoteCode::seats,
           formatted("the cube's orientation varies by {} rad about each axis (standard deviation) "
                     "each time the cube is laid down; the coefficients and their uncertainty "
                     "include this variation",
                     number_text(fit.seat_sd(), 2))});
    }
    return sources_of(inputs, fit.shares());
  }
  if (has_normals) {
    estimate.notes.push_back(
        {NoteCode::face_normals,
         "the readings do not separate the errors of the cube's face normals from noise, so the "
         "stated uncertainties do not include the uncertainty of the face normals"});
  }
  return {};
}

}  // namespace axiscal
