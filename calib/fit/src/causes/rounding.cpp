// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/reading_step.hpp"
#include "calib/fit/rounding_scatter.hpp"
#include "calib/fit/src/axis_regression.hpp"
#include "calib/fit/src/causes/causes.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the rounding steps. A detected step that is wide relative to the range of the readings is
// set to 0, because it may be a difference between values of the field.
Eigen::MatrixXd counted_steps(const ReadingSet& set,
                              double stated_step,
                              const Eigen::VectorXd& noise_sd) {
  constexpr double largest_share = 0.02;
  Eigen::MatrixXd steps = detect_rounding_steps(set.response, set.weights, stated_step, noise_sd);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const std::vector<double> readings = set.readings_of_axis(k);
    const auto [least, most] = std::minmax_element(readings.begin(), readings.end());
    const double step = steps.col(k).maxCoeff();
    if (step != stated_step && !(step <= largest_share * (*most - *least))) {
      steps.col(k).setZero();
    }
  }
  return steps;
}

constexpr double wide =
    0.4;  // limit of the noise, in steps; smaller noise does not average out the rounding error

// The poses of one axis, with the mean of its readings in each pose.
struct Poses {
  std::vector<Eigen::Index> first;  // first reading of each pose
  Eigen::VectorXd mean;
  // Standard deviation of the readings within a pose. If no pose has repeats, it is that of the
  // residuals of the fit.
  double scatter = 0.0;
};

Poses poses_of(const ReadingSet& set, const std::vector<int>& group, Eigen::Index axis, double s) {
  const auto count = static_cast<std::size_t>(1 + *std::max_element(group.begin(), group.end()));
  std::vector<double> sum(count, 0.0);
  std::vector<double> squares(count, 0.0);
  std::vector<double> readings(count, 0.0);
  std::vector<Eigen::Index> first(count, -1);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    if (set.weights(i, axis) > 0.0) {
      const auto g = static_cast<std::size_t>(group[static_cast<std::size_t>(i)]);
      first[g] = first[g] < 0 ? i : first[g];
      // Differences from the first reading lose fewer digits than the readings themselves.
      const double v = set.response(i, axis) - set.response(first[g], axis);
      sum[g] += v;
      squares[g] += v * v;
      readings[g] += 1.0;
    }
  }
  Poses poses;
  std::vector<double> means;
  double within = 0.0;
  double free = 0.0;
  for (std::size_t g = 0; g < count; ++g) {
    if (readings[g] > 0.0) {
      poses.first.push_back(first[g]);
      means.push_back(set.response(first[g], axis) + sum[g] / readings[g]);
      within += std::max(squares[g] - sum[g] * sum[g] / readings[g], 0.0);
      free += readings[g] - 1.0;
    }
  }
  poses.mean =
      Eigen::Map<const Eigen::VectorXd>(means.data(), static_cast<Eigen::Index>(means.size()));
  poses.scatter = free > 0.0 ? std::sqrt(within / free) : s;
  return poses;
}

// The variances of an axis's coefficients, computed for rounding errors that are equal in all
// readings with the same rounded value.
struct RoundedFit {
  Eigen::VectorXd variance;
  double degrees_of_freedom = 0.0;
};

// Fits the means of the poses. Returns nullopt if they do not determine the coefficients.
// @param map   the matrix that converts coefficients of the design's columns to those of the model.
// @param step  the rounding step of each pose.
std::optional<RoundedFit> fit_poses(const Poses& poses,
                                    const Eigen::MatrixXd& design,
                                    const Eigen::MatrixXd& map,
                                    const Eigen::VectorXd& step) {
  const Eigen::Index n = design.rows();
  const Eigen::Index c = design.cols();
  if (n <= c) {
    return std::nullopt;
  }
  const auto [inverse, rank] = pseudo_inverse_with_rank(design);
  if (rank < c) {
    return std::nullopt;
  }
  const Eigen::MatrixXd G = map * inverse;
  const Eigen::VectorXd residuals = poses.mean - design * (inverse * poses.mean);
  RoundedFit fit{.variance = Eigen::VectorXd(map.rows()),
                 .degrees_of_freedom = static_cast<double>(n - c)};
  const double s2 = std::max(residuals.squaredNorm() / fit.degrees_of_freedom,
                             step.squaredNorm() / (12.0 * static_cast<double>(n)));
  for (Eigen::Index j = 0; j < map.rows(); ++j) {
    double shared = 0.0;
    for (Eigen::Index a = 0; a < n; ++a) {
      for (Eigen::Index b = 0; b < n; ++b) {
        const bool one_digit =
            std::abs(poses.mean(a) - poses.mean(b)) < 0.5 * std::min(step(a), step(b));
        shared += one_digit || a == b ? step(a) * step(b) / 12.0 * G(j, a) * G(j, b) : 0.0;
      }
    }
    fit.variance(j) = std::max(s2 * G.row(j).squaredNorm(), shared);
  }
  return fit;
}

}  // namespace

void allow_for_rounding(const ReadingSet& set, double stated_step, FitStatistics& statistics) {
  const bool has_repeats =
      std::any_of(statistics.lack_of_fit.begin(), statistics.lack_of_fit.end(),
                  [](const LackOfFit& test) { return test.pure_error_dof > 0.0; });
  if (!has_repeats) {
    return;
  }
  const Eigen::RowVectorXd steps = counted_steps(set, stated_step, {}).colwise().maxCoeff();
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    LackOfFit& test = statistics.lack_of_fit[static_cast<std::size_t>(k)];
    if (!(test.pure_error_dof > 0.0) || !(test.pure_error_sd < wide * steps(k))) {
      continue;
    }
    const auto readings = static_cast<double>((set.weights.col(k).array() > 0.0).count());
    const double repeats = readings / (readings - test.pure_error_dof);
    const double within = test.pure_error_sd * test.pure_error_sd;
    const double all = statistics.residual_sd(k) * statistics.residual_sd(k);
    const double between = (all * statistics.degrees_of_freedom(k) - within * test.pure_error_dof) /
                           test.lack_of_fit_dof;
    test.f = between / (within + repeats * steps(k) * steps(k) / 12.0);
    test.p_value =
        test.f > 0.0 ? f_upper_p(test.f, test.lack_of_fit_dof, test.pure_error_dof) : 1.0;
  }
}

bool rounding_explains(const SolvedReadings& of, double stated_step, const Estimate& estimate) {
  const ReadingSet& set = of.set();
  const Eigen::MatrixXd steps = counted_steps(set, stated_step, estimate.statistics.residual_sd);
  const Eigen::VectorXd widest = steps.colwise().maxCoeff();
  if (!(steps.minCoeff() > 0.0) ||
      (estimate.statistics.residual_sd.array() > widest.array()).any()) {
    return false;
  }
  const Fit run(of, estimate);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const double error = std::abs(run.residual(i, k)) * run.sigma(k);
      if (error > steps(i, k) * std::sqrt(set.weights(i, k))) {
        return false;
      }
    }
  }
  return true;
}

bool is_coarsely_rounded(const ReadingSet& set,
                         double stated_step,
                         const Eigen::VectorXd& residual_sd) {
  const Eigen::MatrixXd steps = counted_steps(set, stated_step, residual_sd);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const double step = steps.col(k).maxCoeff();
    if (residual_sd(k) < wide * step && step > 4.0 * set.rounding(k)) {
      return true;
    }
  }
  return false;
}

namespace {

void add_rounding_scatter(const SolvedReadings& of, double stated_step, Estimate& estimate) {
  const ReadingSet& set = of.set();
  FitStatistics& statistics = estimate.statistics;
  fill_intervals(statistics);
  constexpr std::size_t most_poses = 500;
  if (set.temperature.order > 0 || set.robust) {
    return;
  }
  // The noise is not needed here: it affects which step is detected, but not whether a step is
  // found.
  bool has_steps = false;
  for (Eigen::Index k = 0; k < set.axis_count() && !has_steps; ++k) {
    has_steps = detect_rounding_step(set.readings_of_axis(k), stated_step).has_value();
  }
  if (!has_steps) {
    return;
  }
  const std::vector<int> group = groups_of_readings(set);
  if (static_cast<std::size_t>(*std::max_element(group.begin(), group.end())) >= most_poses) {
    return;
  }
  const Eigen::Index p = set.coefficient_count();
  WiderIntervals wider("rounding", estimate);
  std::optional<Fit> run;
  std::vector<std::string> axes;
  double widest = 0.0;
  std::vector<Poses> poses_of_axes;
  Eigen::VectorXd scatter(set.axis_count());
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    poses_of_axes.push_back(poses_of(set, group, k, statistics.residual_sd(k)));
    scatter(k) = poses_of_axes.back().scatter;
  }
  const Eigen::MatrixXd steps = counted_steps(set, stated_step, scatter);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Poses& poses = poses_of_axes[static_cast<std::size_t>(k)];
    const double step = steps.col(k).maxCoeff();
    if (!(poses.scatter < wide * step) || step <= 4.0 * set.rounding(k)) {
      continue;
    }
    // If the field's direction is fitted, the design has columns for the direction, because fitting
    // the direction makes the coefficients less certain. In a transfer (fewer than three field
    // directions), the direction is known.
    const bool is_transfer = set.seen.cols() > 0;
    if (!is_transfer && !run) {
      run.emplace(of, estimate);
    }
    const Eigen::MatrixXd columns =
        is_transfer ? set.observable_columns(AxisDesigns(set, estimate.field).of(k), k)
                    : Eigen::MatrixXd(run->own_columns(k));
    const Eigen::MatrixXd map = is_transfer
                                    ? set.observable_column_map()
                                    : Eigen::MatrixXd::Identity(columns.cols(), columns.cols());
    std::optional<RoundedFit> rounded =
        fit_poses(poses, columns(poses.first, Eigen::all), map, steps.col(k)(poses.first));
    if (!rounded) {
      continue;
    }
    axes.push_back(set.axes[static_cast<std::size_t>(k)]);
    widest = std::max(widest, step);
    wider.component().sd(k) = step / std::sqrt(12.0);
    for (Eigen::Index j = 0; j < std::min(p, rounded->variance.size()); ++j) {
      wider.widen(p * k + j, rounded->variance(j), rounded->degrees_of_freedom);
    }
  }
  if (axes.empty()) {
    return;
  }
  wider.put();
  estimate.notes.push_back(
      {NoteCode::rounding,
       formatted(
           "axis {}: the rounding step of the readings ({}) is wider than their noise, so repeats "
           "do not average out the rounding error. The uncertainty includes this error. Record "
           "more digits, or add a dither of half a step before rounding",
           joined(axes), number_text(widest, 3))});
}

CountedEstimate counted_rounding(const ScatterAnalysisInput& run, CountedEstimate so_far) {
  add_rounding_scatter(run.fitted, run.experiment.stated.resolution, so_far.estimate);
  return so_far;
}

}  // namespace

Cause rounding_cause() {
  return {.name = "rounding", .counted = counted_rounding};
}

}  // namespace axiscal
