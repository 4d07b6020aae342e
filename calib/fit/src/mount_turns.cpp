// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/mount_turns.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <Eigen/Geometry>

#include "axiscal/calib/further_columns.hpp"
#include "axiscal/calib/linearised_run.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/scaled_qr.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_mounts = 40;

// Orthonormal changes of so many values that sum to 0; B x (B - 1).
Eigen::MatrixXd contrasts(std::size_t count) {
  return orthogonal_complement(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(count)));
}

// How each contrast of turns changes the readings, in their noise, as a run's rows; (n m) x 3 (B -
// 1).
Eigen::MatrixXd mount_columns(const LinearisedRun& run,
                              const Estimate& estimate,
                              const std::map<int, Eigen::Vector3d>& mounts) {
  const ReadingSet& set = run.set();
  const Eigen::Index m = run.axes();
  const Eigen::MatrixXd C = contrasts(mounts.size());
  Eigen::MatrixXd columns(run.readings() * m, 3 * C.cols());
  for (Eigen::Index i = 0; i < run.readings(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto place = std::distance(mounts.begin(), mounts.find(set.readings[at].mount));
    const Eigen::Vector3d field =
        set.rotation_sensor_from_table[at] * set.field_in_table(i, estimate.field);
    for (Eigen::Index k = 0; k < m; ++k) {
      // S d x f = -S [f]x d
      const Eigen::RowVector3d change = -run.change_with_field(i, k) * cross_matrix(field);
      for (Eigen::Index c = 0; c < C.cols(); ++c) {
        columns.block<1, 3>(run.row_of(i, k), 3 * c) = C(place, c) * change;
      }
    }
  }
  return columns;
}

}  // namespace

std::optional<MountStep> step_of_mounts(const ReadingSet& set,
                                        const Estimate& estimate,
                                        bool known_field) {
  MountStep step;
  for (const Reading& reading : set.readings) {
    step.turns.emplace(reading.mount, Eigen::Vector3d::Zero());
  }
  if (step.turns.size() < 2 || step.turns.size() > most_mounts || !estimate.field.has_vectors() ||
      set.rotation_sensor_from_table.empty() || set.axis_count() < 2) {
    return std::nullopt;
  }
  StateOfRun state(set, known_field);
  const LinearisedRun run(state, estimate);
  constexpr double open_below = 1e-7;
  const std::optional<FurtherColumns> fit = fit_further_columns(
      run.columns(), run.residuals(), mount_columns(run, estimate, step.turns), 1.0, open_below);
  if (!fit) {
    return std::nullopt;
  }
  const Eigen::VectorXd& by_contrast = fit->estimate;
  const Eigen::MatrixXd C = contrasts(step.turns.size());
  Eigen::Index place = 0;
  for (auto& [mount, turn] : step.turns) {
    for (Eigen::Index c = 0; c < C.cols(); ++c) {
      turn += C(place, c) * by_contrast.segment<3>(3 * c);
    }
    ++place;
  }
  step.expected = fit->covariance.diagonal().tail(by_contrast.size()).mean();
  return step;
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
