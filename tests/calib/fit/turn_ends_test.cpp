// SPDX-License-Identifier: Apache-2.0
// Directions and seats at the rests of a gyroscope's log, and their uncertainties.
#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/turns.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

// The stated covariance of the directions agrees with directions by accelerometers with random
// errors.
TEST(TurnEnds, DirectionsAreAsUncertainAsTheAccelerometer) {
  Calibration accelerometer;
  accelerometer.sensor = test::accelerometer_truth();
  Eigen::MatrixXd root(12, 12);
  RandomStream random(5);
  for (double& value : root.reshaped()) {
    value = 1e-5 * random.normal();
  }
  FitStatistics& statistics = accelerometer.fit.statistics.emplace();
  statistics.covariance = root * root.transpose();
  statistics.degrees_of_freedom = Eigen::Vector3d::Constant(20.0);
  const Eigen::Vector3d before = accelerometer.sensor.response.at(Eigen::Vector3d(0.6, 0.0, 0.8));
  const Eigen::Vector3d after = accelerometer.sensor.response.at(Eigen::Vector3d(0.0, -0.8, 0.6));
  GyroscopeTurn turn;
  between_directions(accelerometer, before, after, turn);
  EXPECT_MATRIX_NEAR(turn.up_before, Eigen::Vector3d(0.6, 0.0, 0.8), 1e-12);
  Eigen::Matrix<double, 6, 6> drawn = Eigen::Matrix<double, 6, 6>::Zero();
  constexpr int draws = 20000;
  for (int i = 0; i < draws; ++i) {
    const Eigen::VectorXd error = root * random.normals<12>();
    Calibration other = accelerometer;
    other.fit.statistics.reset();
    for (Eigen::Index k = 0; k < 3; ++k) {
      other.sensor.response.bias(k) += error(4 * k);
      other.sensor.response.sensitivity.row(k) += error.segment<3>(4 * k + 1).transpose();
    }
    GyroscopeTurn one;
    between_directions(other, before, after, one);
    Eigen::Matrix<double, 6, 1> change;
    change << one.up_before - turn.up_before, one.up_after - turn.up_after;
    drawn += change * change.transpose() / draws;
  }
  Eigen::MatrixXd errors(6, 12);
  errors << turn.errors_before, turn.errors_after;
  const Eigen::MatrixXd stated = errors * errors.transpose();
  EXPECT_MATRIX_NEAR(drawn, stated, 0.05 * stated.diagonal().maxCoeff());
}

// The stated errors are the rotation that wrong face normals cause.
TEST(TurnEnds, SeatsAreAsUncertainAsTheNormals) {
  PositionerDescription description = Positioner().description();
  NormalCovariance covariance = NormalCovariance::Zero();
  const Eigen::Index moved = 3 * static_cast<Eigen::Index>(Face::minus_z);
  covariance(moved, moved) = 1e-8;  // normal of -Z along x: 1e-4 rad
  description.normal_covariance = covariance;
  const Positioner believed(description);
  FaceNormals normals = believed.normals();
  normals[static_cast<std::size_t>(Face::minus_z)] = Eigen::Vector3d(1e-4, 0.0, -1.0).normalized();
  const Positioner made(normals);
  const Eigen::Matrix3d mount = rotation_by(Eigen::Vector3d(0.3, -0.2, 0.5));
  const DesignPoint before(Face::minus_z, Face::plus_y);
  const DesignPoint after(Face::plus_x, Face::plus_y);
  GyroscopeTurn stated;
  set_turn_between_seats(believed, mount, before, after, stated);
  GyroscopeTurn true_one;
  set_turn_between_seats(made, mount, before, after, true_one);
  Eigen::Index column = 0;
  stated.errors_before.colwise().norm().maxCoeff(&column);
  const Eigen::Matrix3d R = *stated.rotation_before_from_after;
  // The stated rotation with its errors is exp(before) R exp(-after).
  const Eigen::Matrix3d moved_R = rotation_by(stated.errors_before.col(column)) * R *
                                  rotation_by(-stated.errors_after.col(column));
  const Eigen::AngleAxisd left(
      Eigen::Matrix3d(*true_one.rotation_before_from_after * moved_R.transpose()));
  const Eigen::AngleAxisd whole(
      Eigen::Matrix3d(*true_one.rotation_before_from_after * R.transpose()));
  EXPECT_NEAR(whole.angle(), 1e-4, 1e-8);
  // The sign of a column of the root is arbitrary.
  EXPECT_TRUE(left.angle() < 1e-8 || std::abs(left.angle() - 2e-4) < 1e-8);
}

TEST(TurnEnds, TheEarthTurnsAboutUpAsTheSiteSays) {
  std::vector<GyroscopeTurn> turns(1);
  turns[0].up_before = Eigen::Vector3d(0.0, 0.6, 0.8);
  TurnFitOptions options;
  set_earth_rotation(Site{.latitude_deg = 30.0}, turns, options);
  EXPECT_MATRIX_NEAR(turns[0].earth_rate_in_sensor,
                     Eigen::Vector3d(0.5 * 7.292115e-5 * turns[0].up_before), 1e-15);
  EXPECT_EQ(options.earth_up_u, 0.0);
  EXPECT_NEAR(options.earth_across_u, 7.292115e-5 * std::sqrt(0.75 / 2.0), 1e-12);
  turns[0].earth_rate_in_sensor.setZero();
  set_earth_rotation(std::nullopt, turns, options);
  EXPECT_TRUE(turns[0].earth_rate_in_sensor.isZero(0.0));
  EXPECT_NEAR(std::sqrt(3.0) * options.earth_up_u, 7.292115e-5, 1e-12);
}

// Correlated or drifting rests: the intervals cover the true bias at the middle of the log.
TEST(RestsOfALog, AreCountedAsTheirOrderSays) {
  RandomStream random(9);
  struct World {
    double rho;
    double drift;  // over the log [sd of the rests]
  };
  for (const World& world : {World{0.0, 0.0}, World{0.6, 0.0}, World{0.9, 0.0}, World{0.0, 5.0}}) {
    int held = 0;
    int told = 0;
    constexpr int logs = 200;
    constexpr Eigen::Index n = 30;
    for (int log = 0; log < logs; ++log) {
      Eigen::MatrixX3d means(n, 3);
      Eigen::MatrixX3d ups(n, 3);
      for (Eigen::Index i = 0; i < n; ++i) {
        const Eigen::RowVector3d fresh = random.normals<3>().transpose();
        means.row(i) = i == 0 ? fresh
                              : Eigen::RowVector3d(world.rho * means.row(i - 1) +
                                                   std::sqrt(1.0 - world.rho * world.rho) * fresh);
        ups.row(i) = random.normals<3>().normalized().transpose();
      }
      means.colwise() += world.drift * Eigen::VectorXd::LinSpaced(n, -0.5, 0.5);
      const RestFit fit = fit_rests(means, ups);
      told += fit.remark.empty() ? 0 : 1;
      const double t = student_t_factor(0.95, fit.degrees_of_freedom);
      for (int k = 0; k < 3; ++k) {
        held += std::abs(fit.bias(k)) <= t * std::sqrt(fit.bias_covariance(k, k)) ? 1 : 0;
      }
    }
    const double share = static_cast<double>(held) / (3.0 * logs);
    EXPECT_GE(share, 0.92) << world.rho << " " << world.drift;  // plain fits: 67, 30 % at 0.6, 0.9
    const bool is_white = world.rho == 0.0 && world.drift == 0.0;
    EXPECT_TRUE(is_white ? told < logs / 6 : told > logs / 2) << told;
  }
}

}  // namespace
}  // namespace axiscal
