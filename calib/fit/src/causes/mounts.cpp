// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Geometry>

#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/src/causes/causes.hpp"
#include "calib/record/parameter_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Adds a component "mounts" to the covariance: the instrument's orientation in the cube scatters
// between its B mounts, so the mean orientation is uncertain. The component has 3 (B - 1) degrees
// of freedom. The fit of the rotations reduces the degrees of freedom of each of the m axes by
// 3 (B - 1) / m (method.md, section 4).
// @return false if an axis would have no degrees of freedom left; the estimate is then not changed.
bool add_mount_scatter(const std::map<int, Eigen::Matrix3d>& turns,
                       double expected,
                       Estimate& estimate) {
  FitStatistics& statistics = estimate.statistics;
  const auto count = static_cast<double>(turns.size());
  const double nu = 3.0 * (count - 1.0);
  const Eigen::Index m = estimate.response.bias.size();
  const Eigen::Index p = statistics.covariance.rows() / m;
  // The degrees of freedom of each axis, reduced by its share of the fitted rotations.
  const Eigen::VectorXd left = statistics.degrees_of_freedom.array() - nu / static_cast<double>(m);
  if (!(left.minCoeff() > 0.5)) {
    return false;
  }
  const Eigen::VectorXd inflation = statistics.degrees_of_freedom.cwiseQuotient(left);
  Eigen::MatrixXd of_readings = statistics.covariance_of_readings();
  const Eigen::MatrixXd of_components = statistics.covariance - of_readings;
  for (Eigen::Index k = 0; k < m; ++k) {
    const double factor = std::sqrt(inflation(k));
    statistics.residual_sd(k) *= factor;
    of_readings.middleRows(p * k, p) *= factor;
    of_readings.middleCols(p * k, p) *= factor;
  }
  statistics.degrees_of_freedom = left;
  statistics.covariance = of_readings + of_components;
  double squares = 0.0;
  for (const auto& [mount, turn] : turns) {
    const Eigen::AngleAxisd rotation(turn);
    squares += rotation.angle() * rotation.angle();
  }
  const double more = std::max(squares / nu - inflation.mean() * expected, 0.0);
  ScatterComponent component{.name = "mounts",
                             .sd = Eigen::VectorXd::Constant(1, std::sqrt(more)),
                             .unit = "rad",
                             .covariance = Eigen::MatrixXd::Zero(p * m, p * m),
                             .degrees_of_freedom = nu};
  for (int axis = 0; axis < 3; ++axis) {
    const SensitivityMatrix change =
        estimate.response.sensitivity * cross_matrix(Eigen::Vector3d::Unit(axis));
    Eigen::VectorXd by_parameters = Eigen::VectorXd::Zero(p * m);
    for (Eigen::Index k = 0; k < m; ++k) {
      by_parameters.segment<3>(p * k + 1) = change.row(k).transpose();
    }
    component.covariance += more / count * by_parameters * by_parameters.transpose();
  }
  if (statistics.interval_dof.size() > 0) {
    put_intervals(statistics);  // if seats are fitted, each parameter has its own interval_dof
  }
  if (more > 0.0) {
    estimate.notes.push_back(
        {NoteCode::seats, formatted("the orientation of the instrument differs between its {} "
                                    "mounts by {} rad about each axis (standard deviation); the "
                                    "uncertainty of the cross-axis terms includes this difference",
                                    turns.size(), number_text(component.sd(0), 2))});
    add_component(std::move(component), statistics);
  }
  return true;
}

CountedEstimate counted_mounts(const ScatterAnalysisInput& run, CountedEstimate so_far) {
  so_far.mounts_counted =
      run.mounts.size() > 1 && add_mount_scatter(run.mounts, run.mounts_expected, so_far.estimate);
  return so_far;
}

}  // namespace

Cause mounts_cause() {
  return {.name = "mounts", .changes_fit = true, .counted = counted_mounts};
}

}  // namespace axiscal
