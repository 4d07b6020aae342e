// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/layings.hpp"
#include "calib/fit/src/causes/causes.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/common_noise.hpp"

namespace axiscal {
namespace {

// The mean square of the deviations of means from the fit, for one axis. The means are averages
// over consecutive readings at one design point, or over all readings of a pose. A test compares
// the mean square with that of the readings about these means.
struct MeanSquares {
  double between = 0.0;
  double degrees_of_freedom = 0.0;
  double p_value = 1.0;  // p-value of the ratio of `between` to the mean square about the means
};

// Returns the MeanSquares of each axis, with means over consecutive readings at one design point.
// The result is empty if no two consecutive readings are at the same design point.
std::vector<MeanSquares> of_layings(const ReadingSet& set, const Estimate& estimate) {
  const MeanReadings layings = average_layings(set, estimate);
  const FitStatistics& statistics = estimate.statistics;
  std::vector<MeanSquares> axes;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const double nu = statistics.degrees_of_freedom(k);
    const double within_dof = layings.degrees_of_freedom(k);
    const double dof = nu - within_dof;
    const double squares = nu * statistics.residual_sd(k) * statistics.residual_sd(k);
    if (!(within_dof > 0.0) || !(dof >= 1.0) || !(layings.squares(k) > 0.0)) {
      return {};
    }
    const double between = std::max(squares - layings.squares(k), 0.0) / dof;
    const double within = layings.squares(k) / within_dof;
    axes.push_back({.between = between,
                    .degrees_of_freedom = dof,
                    .p_value = f_upper_p(between / within, dof, within_dof)});
  }
  return axes;
}

// Returns the MeanSquares of each axis, with means over all readings of a pose. The result is empty
// if no pose was repeated.
std::vector<MeanSquares> of_poses(const FitStatistics& statistics) {
  std::vector<MeanSquares> axes;
  for (const LackOfFit& test : statistics.lack_of_fit) {
    if (!(test.f > 0.0) || !(test.pure_error_sd > 0.0)) {
      return {};
    }
    axes.push_back({.between = test.f * test.pure_error_sd * test.pure_error_sd,
                    .degrees_of_freedom = test.lack_of_fit_dof,
                    .p_value = test.p_value});
  }
  return axes;
}

// Returns the probability that the means of all axes scatter this much by chance. It allows for
// noise that the axes share, which makes the tests of the axes dependent.
double p_of_axes(const std::vector<MeanSquares>& axes,
                 const SolvedReadings& fitted,
                 const Estimate& estimate) {
  FisherSum tests;
  for (const MeanSquares& axis : axes) {
    tests.add(axis.p_value);
  }
  const Fit fit(fitted, estimate);
  const Eigen::MatrixXd residuals =
      fit.residuals().reshaped(fit.axes(), fit.readings()).transpose();
  return tests.p_value(
      dof_reduction_factor(residuals, estimate.statistics.degrees_of_freedom.mean()));
}

// If the p-value is below this, the means clearly scatter more than the readings within the groups.
constexpr double clearly_more = 0.02;

// If the means scatter more than the readings within the groups, computes the intervals from the
// mean square of the means.
// @param level  level of significance of the test.
// @return the p-value of the test if an interval became longer, otherwise 1.
double widen_by(const std::vector<MeanSquares>& axes,
                double level,
                const std::string& name,
                const SolvedReadings& fitted,
                Estimate& estimate) {
  const bool may_be_larger = std::any_of(axes.begin(), axes.end(), [&](const MeanSquares& axis) {
    return axis.p_value < 10.0 * level;
  });
  const double p_value = may_be_larger ? p_of_axes(axes, fitted, estimate) : 1.0;
  if (!(p_value < level)) {
    return 1.0;
  }
  const FitStatistics& statistics = estimate.statistics;
  const Eigen::MatrixXd of_readings = statistics.covariance_of_readings();
  const auto m = static_cast<Eigen::Index>(axes.size());
  const Eigen::Index p = statistics.covariance.rows() / m;
  WiderIntervals wider(name, estimate);
  for (Eigen::Index k = 0; k < m; ++k) {
    const MeanSquares& axis = axes[static_cast<std::size_t>(k)];
    const double ratio = axis.between / (statistics.residual_sd(k) * statistics.residual_sd(k));
    for (Eigen::Index j = p * k; j < p * (k + 1) && ratio > 1.0; ++j) {
      wider.widen(j, ratio * of_readings(j, j), axis.degrees_of_freedom);
    }
  }
  return wider.put() ? p_value : 1.0;
}

// Lengthens intervals if readings share errors. Consecutive readings at one design point share the
// error of the cube's seat. All readings of one pose may share an error, for example from dirt
// under a foot, from a cable or from the cube. The means of such readings then scatter more than
// the readings scatter about them, and the scatter of the means determines the uncertainty.
CountedEstimate counted_poses(const ScatterAnalysisInput& run, CountedEstimate so_far) {
  Estimate& estimate = so_far.estimate;
  const FitStatistics& statistics = estimate.statistics;
  // The covariance may already include shared errors of mounts, soaks or uncertain inputs. Errors
  // of seats are those of layings; they differ between the blocks, so they cannot explain an error
  // that repeats in all blocks. A mistake in a reading looks like an error of its pose.
  const bool has_seats = statistics.find_component("seats") != nullptr;
  const bool has_others = std::any_of(
      statistics.components.begin(), statistics.components.end(),
      [](const ScatterComponent& one) { return one.name != "seats" && one.name != "layings"; });
  const bool is_weighed = !so_far.weighed.empty() || has_others;
  if (is_weighed || run.has_mistake || run.is_transfer() || run.experiment.fit.robust ||
      run.fitted.set().temperature.order > 0 || !(statistics.residual_sd.minCoeff() > 0.0)) {
    return so_far;
  }
  if (!run.method.averages_pairs && !has_seats) {
    // Errors of layings are usual, so the intervals include them also if they are less certain.
    constexpr double perhaps_more = 0.1;
    const double p_value = widen_by(of_layings(run.fitted.set(), estimate), perhaps_more, "layings",
                                    run.fitted, estimate);
    so_far.means_counted = p_value < perhaps_more;
    if (p_value < clearly_more) {
      estimate.notes.push_back({NoteCode::correlation, note_of_layings});
    }
  }
  const double p_of_poses =
      widen_by(of_poses(statistics), clearly_more, "poses", run.fitted, estimate);
  so_far.poses_counted = p_of_poses < clearly_more;
  constexpr double told_below = 0.01;
  if (p_of_poses < told_below) {
    estimate.notes.push_back({NoteCode::seats,
                              "each pose has its own error, which repeats in all blocks. The "
                              "intervals include this error. Clean the feet and the table, and "
                              "check the cable"});
  }
  return so_far;
}

}  // namespace

Cause poses_cause() {
  return {.name = "poses", .counted = counted_poses};
}

}  // namespace axiscal
