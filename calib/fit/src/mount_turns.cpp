// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/mount_turns.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/calib/fit.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_mounts = 40;

}  // namespace

std::optional<MountTurns> fitted_mounts(const ReadingSet& set,
                                        const Estimate& estimate,
                                        bool known_field) {
  const bool one_mount = std::all_of(
      set.readings.begin(), set.readings.end(),
      [&](const Reading& reading) { return reading.mount == set.readings.front().mount; });
  if (one_mount || !estimate.field.has_vectors() || set.rotation_sensor_from_table.empty() ||
      set.axis_count() < 2) {
    return std::nullopt;
  }
  const Model model = Model(set, known_field).with_free_mounts();
  const Place start = model.start(estimate.field);
  if (start.mounts.size() > most_mounts) {
    return std::nullopt;
  }
  const Eigen::VectorXd& sigma = estimate.statistics.residual_sd;
  const auto found = model.solved(model.at(start), sigma);
  const Fit fit(set, found.state, sigma);
  if (!found.converged || !fit.is_determined()) {
    return std::nullopt;
  }
  const Eigen::Index turns = fit.shared() - found.state->direction_count();
  return MountTurns{.turns = found.state->place.mounts,
                    .expected = fit.covariance_of_shared().diagonal().tail(turns).mean()};
}

bool add_mount_scatter(const std::map<int, Eigen::Matrix3d>& turns,
                       double expected,
                       Estimate& estimate) {
  FitStatistics& statistics = estimate.statistics;
  const auto count = static_cast<double>(turns.size());
  const double nu = 3.0 * (count - 1.0);
  const Eigen::Index m = estimate.response.bias.size();
  const Eigen::Index p = statistics.covariance.rows() / m;
  // The turns took degrees of freedom, of each axis its part.
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
    put_intervals(statistics);  // of seats each parameter has its own degrees of freedom
  }
  if (more > 0.0) {
    estimate.notes.push_back(
        {NoteCode::seats,
         formatted(
             "the instrument sits anew in the cube in each of {} mounts, by {} rad about each "
             "axis (standard deviation); cross-axis terms and their uncertainty count it",
             turns.size(), number_text(component.sd(0), 2))});
    add_component(std::move(component), statistics);
  }
  return true;
}

}  // namespace axiscal
