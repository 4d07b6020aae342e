// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/turns.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/earth_rotation_field.hpp"
#include "calib/fit/input_quantities.hpp"
#include "calib/regression/common_mean.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/serial_correlation.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The upward vertical that an accelerometer measures, and its derivative with respect to the errors
// of the accelerometer's calibration.
struct Direction {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd errors;
};

// Computes the direction from f = S^-1 (v - b). The derivative follows from df = -S^-1 (db + dS f).
// For each axis k, the parameters are b_k and row k of S.
Direction direction_of(const Calibration& accelerometer,
                       const Eigen::MatrixXd& root,
                       const Eigen::Vector3d& mean) {
  const Eigen::Matrix3d inverse =
      Eigen::Matrix3d(accelerometer.sensor.response.sensitivity).inverse();
  const Eigen::Vector3d field = inverse * (mean - accelerometer.sensor.response.bias);
  Direction direction{.up = field.normalized(), .errors = {}};
  if (root.rows() != 12) {
    return direction;
  }
  Eigen::Matrix<double, 3, 12> change;
  for (Eigen::Index k = 0; k < 3; ++k) {
    change.col(4 * k) = -inverse.col(k);
    change.middleCols<3>(4 * k + 1) = -inverse.col(k) * field.transpose();
  }
  const Eigen::Matrix3d across =
      Eigen::Matrix3d::Identity() - direction.up * direction.up.transpose();
  direction.errors = across / field.norm() * change * root;
  return direction;
}

// Computes the derivative of a cube's attitude C with respect to the face normals, as the rotation
// vector of dC C^T. The rotation vector is computed from the changes of the table's three axes.
Eigen::Matrix3Xd attitude_errors(const Positioner& positioner,
                                 const Eigen::Matrix3d& rotation_sensor_from_positioner,
                                 const DesignPoint& point,
                                 const Eigen::MatrixXd& root) {
  const Eigen::Matrix3d table_from_positioner = positioner.rotation_table_from_positioner(point);
  Eigen::Matrix3Xd errors = Eigen::Matrix3Xd::Zero(3, root.cols());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d along =
        rotation_sensor_from_positioner * table_from_positioner.row(axis).transpose();
    const Eigen::Matrix3Xd moved =
        rotation_sensor_from_positioner *
        change_with_normals(table_from_positioner, point, Eigen::Vector3d::Unit(axis)) * root;
    // For three orthonormal vectors e that rotate by w, the sum of e cross (w cross e) is 2 w.
    for (Eigen::Index j = 0; j < root.cols(); ++j) {
      errors.col(j) += 0.5 * along.cross(Eigen::Vector3d(moved.col(j)));
    }
  }
  return errors;
}

}  // namespace

void between_directions(const Calibration& accelerometer,
                        const Eigen::Vector3d& mean_before,
                        const Eigen::Vector3d& mean_after,
                        GyroscopeTurn& turn) {
  const Eigen::MatrixXd covariance = parameter_covariance(accelerometer);
  const Eigen::MatrixXd root = covariance.size() > 0 && covariance.allFinite()
                                   ? covariance_root(covariance)
                                   : Eigen::MatrixXd();
  Direction before = direction_of(accelerometer, root, mean_before);
  Direction after = direction_of(accelerometer, root, mean_after);
  turn.up_before = before.up;
  turn.up_after = after.up;
  turn.errors_before = std::move(before.errors);
  turn.errors_after = std::move(after.errors);
}

void set_turn_between_seats(const Positioner& positioner,
                            const Eigen::Matrix3d& rotation_sensor_from_positioner,
                            const DesignPoint& before,
                            const DesignPoint& after,
                            GyroscopeTurn& turn) {
  turn.rotation_before_from_after = rotation_sensor_from_positioner *
                                    positioner.rotation_table_from_positioner(before).transpose() *
                                    positioner.rotation_table_from_positioner(after) *
                                    rotation_sensor_from_positioner.transpose();
  const auto& covariance = positioner.description().normal_covariance;
  const Eigen::MatrixXd root =
      covariance ? covariance_root(*covariance) : Eigen::MatrixXd::Zero(18, 0);
  turn.errors_before = attitude_errors(positioner, rotation_sensor_from_positioner, before, root);
  turn.errors_after = attitude_errors(positioner, rotation_sensor_from_positioner, after, root);
}

void set_earth_rotation(const std::optional<Site>& site,
                        std::vector<GyroscopeTurn>& turns,
                        TurnFitOptions& options) {
  if (!site) {
    options.earth_up_u = options.earth_across_u = earth_rate_rad_per_s / std::sqrt(3.0);
    return;
  }
  const double latitude = site->latitude_deg * rad_per_deg;
  options.earth_across_u = earth_rate_rad_per_s * std::cos(latitude) / std::sqrt(2.0);
  for (GyroscopeTurn& turn : turns) {
    turn.earth_rate_in_sensor = earth_rate_rad_per_s * std::sin(latitude) * turn.up_before;
  }
}

namespace {

// Tests whether the biases drift over the log, and whether the biases of consecutive periods of
// rest are correlated. If so, the result is the biases in the middle of the log, and their
// covariance includes the drift or the correlation.
void look_at_order(const Eigen::MatrixX3d& means, RestFit& fit) {
  const Eigen::Index n = means.rows();
  if (!(fit.sd.minCoeff() > 0.0)) {
    return;
  }
  const Eigen::VectorXd progress = Eigen::VectorXd::LinSpaced(n, -0.5, 0.5);
  const double length = progress.squaredNorm();
  const auto left = static_cast<double>(n - 2);
  // Sum over the axes: the squares that a linear drift explains, divided by the variance of the
  // means about the line.
  double drop = 0.0;
  Eigen::Vector3d sd;
  Eigen::Vector3d drift;
  for (int k = 0; k < 3; ++k) {
    drift(k) = progress.dot(means.col(k)) / length;
    const double whole = fit.sd(k) * fit.sd(k) * static_cast<double>(n - 1);
    const double of_line = drift(k) * drift(k) * length;
    sd(k) = std::sqrt(std::max(whole - of_line, 1e-12 * whole) / left);
    drop += of_line / (sd(k) * sd(k));
  }
  constexpr double false_drift = 0.005;
  const bool drifts = f_upper_p(std::max(drop / 3.0, 1e-300), 3.0, 3.0 * left) < false_drift;
  Eigen::MatrixXd X(n, drifts ? 2 : 1);
  X.col(0).setOnes();
  if (drifts) {
    X.col(1) = progress;
    fit.sd = sd;
    fit.degrees_of_freedom = left;
    fit.bias_covariance = (sd.cwiseAbs2() / static_cast<double>(n)).asDiagonal();
  }
  const OrderedReadings ordered{
      .designs = {X, X, X},
      .responses = means,
      .places = Eigen::VectorXd::LinSpaced(n, 0.0, static_cast<double>(n - 1)),
      .blocks = {}};
  const bool alike = lag_one_score(ordered) > alike_above;
  if (alike) {
    const CorrelatedMean mean = uncertainty_of_correlated_mean(ordered);
    fit.bias_covariance = mean.u.cwiseAbs2().asDiagonal();
    fit.degrees_of_freedom = mean.degrees_of_freedom;
  }
  if (drifts) {
    fit.remark = formatted(
        "the biases at the rests change over the log by {}, {}, {} (drift or slow noise); the "
        "biases in the record are those in the middle of the log",
        number_text(drift(0), 2), number_text(drift(1), 2), number_text(drift(2), 2));
  } else if (alike) {
    fit.remark =
        "the biases of consecutive rests are correlated (drift or slow noise), so they count as "
        "fewer independent biases";
  }
}

// Estimates the standard deviation of the change of the bias between periods of rest. Drift,
// warm-up or the attitude may cause this change. The estimate is at most the scatter of the mean
// readings at rest, which also includes noise.
void compare_rests(const Eigen::MatrixX3d& means, const Eigen::MatrixX3d& mean_u, RestFit& fit) {
  constexpr double coverage = 0.95;
  const auto left = static_cast<double>(means.rows() - 1);
  for (int k = 0; k < 3; ++k) {
    double between = fit.sd(k);
    double freedom = left;
    if (mean_u.col(k).minCoeff() > 0.0) {
      const CommonMean common = common_mean(means.col(k), mean_u.col(k));
      constexpr double by_chance = 0.01;
      if (!(common.p_value < by_chance)) {
        continue;
      }
      if (common.between * student_t_factor(coverage, common.between_degrees_of_freedom) <
          fit.sd(k) * student_t_factor(coverage, left)) {
        between = common.between;
        freedom = common.between_degrees_of_freedom;
      }
    }
    fit.between_rests(k) = between;
    fit.between_degrees_of_freedom(k) = freedom;
  }
}

}  // namespace

RestFit fit_rests(const Eigen::MatrixX3d& means,
                  const Eigen::MatrixX3d& ups,
                  const Eigen::MatrixX3d& mean_u) {
  RestFit fit;
  const auto n = static_cast<double>(means.rows());
  fit.degrees_of_freedom = n - 1.0;
  fit.bias = means.colwise().mean().transpose();
  for (int k = 0; k < 3; ++k) {
    const double rss = (means.col(k).array() - fit.bias(k)).square().sum();
    fit.sd(k) = n > 1.0 ? std::sqrt(rss / (n - 1.0)) : 0.0;
    fit.bias_covariance(k, k) = fit.sd(k) * fit.sd(k) / n;
  }
  if (means.rows() < 8) {
    return fit;
  }
  if (mean_u.rows() > 0) {
    compare_rests(means, mean_u, fit);
  }
  look_at_order(means, fit);
  Eigen::MatrixXd X(means.rows(), 4);
  X << Eigen::VectorXd::Ones(means.rows()), ups;
  if (!undetermined_columns(X).empty()) {
    return fit;
  }
  const LeastSquaresDesign design(X);
  fit.g_sensitivity.emplace();
  fit.g_sensitivity_se.emplace();
  for (int k = 0; k < 3; ++k) {
    const LeastSquaresFit axis = design.fit(means.col(k));
    fit.g_sensitivity->row(k) = axis.estimate.tail<3>().transpose();
    fit.g_sensitivity_se->row(k) = axis.covariance.diagonal().tail<3>().cwiseSqrt().transpose();
    const double explained = fit.sd(k) * fit.sd(k) * (n - 1.0) - axis.residuals.squaredNorm();
    fit.p_value(k) = f_upper_p(
        std::max(0.0, explained) / 3.0 / (axis.residual_sd * axis.residual_sd), 3.0, n - 4.0);
  }
  return fit;
}

}  // namespace axiscal
