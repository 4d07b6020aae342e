// SPDX-License-Identifier: Apache-2.0
// Turns of an instrument in its mounts, and of a gyroscope between rests, compared with linear
// least squares that are written out here.
#include "calib/fit/mount_turns.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "axiscal/calib/turns.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/method_fit.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double mount_noise = 2e-5;

// Readings at all 24 points in each mount. In each mount the instrument is turned by one of
// `turns`.
ReadingSet mounted_set(const std::vector<Eigen::Vector3d>& turns,
                       double noise_sd,
                       std::uint64_t seed) {
  std::vector<DesignEntry> design;
  for (std::size_t mount = 0; mount < turns.size(); ++mount) {
    for (const DesignEntry& entry : standard_design(24)) {
      design.push_back(entry);
    }
  }
  ReadingSet set = test::labelled_set(
      test::some_response(), test::gravity_in_table(test::sloping_gravity), design, noise_sd, seed);
  for (std::size_t i = 0; i < design.size(); ++i) {
    set.readings[i].mount = 10 + static_cast<int>(i / 24);
    const Eigen::Vector3d met = set.rotation_sensor_from_table[i] * test::sloping_gravity;
    set.response.row(static_cast<Eigen::Index>(i)) +=
        (test::some_response().sensitivity * (rotation_by(turns[i / 24]) * met - met)).transpose();
  }
  return set;
}

Estimate estimate_of_mounted(const ReadingSet& set) {
  return estimate_known(set, test::gravity_in_table(test::sloping_gravity));
}

Eigen::Vector3d turn_vector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

// Orthonormal contrasts between three mounts, 3 x 2.
Eigen::MatrixXd contrasts_of_three() {
  Eigen::MatrixXd C(3, 2);
  C << 1.0 / std::sqrt(2.0), 1.0 / std::sqrt(6.0), -1.0 / std::sqrt(2.0), 1.0 / std::sqrt(6.0), 0.0,
      -2.0 / std::sqrt(6.0);
  return C;
}

// All columns of a linear fit of three mounts, axes below each other. First the columns of each
// axis, then S [d_j x f] in terms of the contrasts.
Eigen::MatrixXd columns_with_mounts(const ReadingSet& set, const SensitivityMatrix& S) {
  const Eigen::Index n = set.size();
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  const Eigen::MatrixXd C = contrasts_of_three();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3 * n, 18);
  for (Eigen::Index k = 0; k < 3; ++k) {
    J.block(n * k, 4 * k, n, 4) = X;
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Vector3d met = X.row(i).tail<3>().transpose();
      for (Eigen::Index c = 0; c < 2; ++c) {
        J.block(n * k + i, 12 + 3 * c, 1, 3) = -C(i / 24, c) * S.row(k) * cross_matrix(met);
      }
    }
  }
  return J;
}

const std::vector<Eigen::Vector3d> small_turns = {Eigen::Vector3d(1e-4, -2e-4, 3e-4),
                                                  Eigen::Vector3d(-2e-4, 1e-4, 2e-4),
                                                  Eigen::Vector3d(3e-4, 1e-4, -1e-4)};

TEST(FittedMounts, AgreesWithLinearLeastSquares) {
  const ReadingSet set = mounted_set(small_turns, mount_noise, 1);
  const Estimate estimate = estimate_of_mounted(set);
  const auto found = fitted_mounts(set, estimate, true);
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->turns.size(), 3U);
  const Eigen::VectorXd sigma = estimate.statistics.residual_sd;
  const Eigen::MatrixXd J = columns_with_mounts(set, estimate.response.sensitivity);
  const Eigen::VectorXd weight =
      sigma.cwiseInverse().replicate(1, set.size()).transpose().reshaped();
  const Eigen::VectorXd x =
      (weight.asDiagonal() * J)
          .colPivHouseholderQr()
          .solve(weight.cwiseProduct(Eigen::VectorXd(set.response.reshaped())));
  const Eigen::MatrixXd d = contrasts_of_three() * x.tail<6>().reshaped(3, 2).transpose();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index j = 0; j < 3; ++j) {
    const Eigen::Vector3d turn = turn_vector(found->turns.at(10 + static_cast<int>(j)));
    EXPECT_MATRIX_NEAR(turn, Eigen::Vector3d(d.row(j)), 1e-6);
    sum += turn;
  }
  EXPECT_LT(sum.norm(), 1e-9);
}

TEST(FittedMounts, StatesTheScatterOfTurnsByNoise) {
  const ReadingSet set = mounted_set(small_turns, mount_noise, 2);
  const Estimate estimate = estimate_of_mounted(set);
  const auto found = fitted_mounts(set, estimate, true);
  ASSERT_TRUE(found.has_value());
  const Eigen::VectorXd sigma = estimate.statistics.residual_sd;
  const Eigen::VectorXd weight =
      sigma.cwiseInverse().replicate(1, set.size()).transpose().reshaped();
  const Eigen::MatrixXd J =
      weight.asDiagonal() * columns_with_mounts(set, estimate.response.sensitivity);
  const Eigen::MatrixXd C = (J.transpose() * J).inverse();
  EXPECT_NEAR(found->expected, C.diagonal().tail<6>().mean(), 1e-3 * found->expected);
}

// If the instrument is not turned, the mean over runs of sum |d_j|^2 / 3 (B - 1) is the expected
// mean square.
TEST(FittedMounts, FindsNoMoreThanNoiseIfTheInstrumentStays) {
  constexpr int trials = 60;
  double ratio = 0.0;
  for (std::uint64_t seed = 1; seed <= trials; ++seed) {
    const ReadingSet set =
        mounted_set({3, Eigen::Vector3d(Eigen::Vector3d::Zero())}, mount_noise, seed);
    const auto found = fitted_mounts(set, estimate_of_mounted(set), true);
    ASSERT_TRUE(found.has_value());
    double squares = 0.0;
    for (const auto& [mount, turn] : found->turns) {
      squares += turn_vector(turn).squaredNorm() / 6.0;
    }
    ratio += squares / found->expected / trials;
  }
  EXPECT_NEAR(ratio, 1.0, 0.3);
}

TEST(FittedMounts, FindsTheFieldsDirectionToo) {
  const ReadingSet set = mounted_set(small_turns, mount_noise, 3);
  const Estimate estimate = estimate_joint(set);
  const auto found = fitted_mounts(set, estimate, false);
  ASSERT_TRUE(found.has_value());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& turn : small_turns) {
    mean += turn / 3.0;
  }
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_MATRIX_NEAR(turn_vector(found->turns.at(10 + static_cast<int>(j))),
                       Eigen::Vector3d(small_turns[j] - mean), 5.0 * mount_noise);
  }
}

TEST(FittedMounts, DoesNotDependOnTheUnitOfReadings) {
  const ReadingSet set = mounted_set(small_turns, mount_noise, 4);
  ReadingSet scaled = set;
  scaled.response *= 1000.0;
  const auto a = fitted_mounts(set, estimate_of_mounted(set), true);
  const auto b = fitted_mounts(scaled, estimate_of_mounted(scaled), true);
  EXPECT_MATRIX_NEAR(a->turns.at(11), b->turns.at(11), 1e-10);
  EXPECT_NEAR(a->expected, b->expected, 1e-8 * a->expected);
}

TEST(FittedMounts, NeedsSeveralMountsAndAxes) {
  const ReadingSet one = mounted_set({small_turns[0]}, mount_noise, 5);
  EXPECT_FALSE(fitted_mounts(one, estimate_of_mounted(one), true).has_value());
  ReadingSet single = mounted_set(small_turns, mount_noise, 5);
  single.response.conservativeResize(Eigen::NoChange, 1);
  single.weights.conservativeResize(Eigen::NoChange, 1);
  single.axes.resize(1);
  single.nominal.resize(1);
  EXPECT_FALSE(fitted_mounts(single, estimate_of_mounted(single), true).has_value());
  ReadingSet many = mounted_set({2, small_turns[0]}, mount_noise, 5);
  for (std::size_t i = 0; i < many.readings.size(); ++i) {
    many.readings[i].mount = static_cast<int>(i);
  }
  EXPECT_FALSE(fitted_mounts(many, estimate_of_mounted(many), true).has_value());
}

// A mount with one reading only does not determine its turn.
TEST(FittedMounts, IsNoneIfATurnIsOpen) {
  ReadingSet set = mounted_set({small_turns[0]}, mount_noise, 6);
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    set.readings[i].mount = i < 23 ? 1 : 2;
  }
  EXPECT_FALSE(fitted_mounts(set, estimate_of_mounted(set), true).has_value());
}

// ---- a gyroscope's turns ----

Eigen::Matrix3d gyroscope_sensitivity() {
  Eigen::Matrix3d S;
  S << 1.02, 0.01, -0.02, 0.015, 0.97, 0.01, -0.01, 0.02, 1.01;
  return S;
}

const Eigen::Vector3d gyroscope_bias(0.05, -0.02, 0.01);

// A turn of the gyroscope about one axis of the sensor, with the rotation that the seats state.
struct TurnAboutAxis {
  Eigen::Vector3d rotation;  // axis times angle [rad]
  Eigen::Matrix3d known;     // before from after, by the seats
};

// Readings of turns with the rate sin^2(t). The trapezium rule integrates this rate exactly.
class SimulatedTurns {
 public:
  explicit SimulatedTurns(const std::vector<TurnAboutAxis>& turns,
                          double unit = 1.0,
                          const Eigen::Matrix3d& frame = Eigen::Matrix3d::Identity()) {
    constexpr std::size_t samples = 401;
    constexpr double duration_s = 2.0;
    for (std::size_t s = 0; s < samples; ++s) {
      time_s_.push_back(duration_s * static_cast<double>(s) / (samples - 1));
    }
    readings_.resize(turns.size());
    for (std::size_t t = 0; t < turns.size(); ++t) {
      for (const double time_s : time_s_) {
        const double share =
            std::pow(std::sin(std::numbers::pi * time_s / duration_s), 2) / (0.5 * duration_s);
        const Eigen::Vector3d v =
            unit * (gyroscope_bias + gyroscope_sensitivity() * (share * turns[t].rotation));
        for (std::size_t axis = 0; axis < 3; ++axis) {
          readings_[t][axis].push_back(v(static_cast<Eigen::Index>(axis)));
        }
      }
    }
    for (std::size_t t = 0; t < turns.size(); ++t) {
      GyroscopeTurn& turn = turns_.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        turn.readings[axis] = readings_[t][axis];
      }
      turn.time_s = time_s_;
      turn.rotation_before_from_after = frame * turns[t].known * frame.transpose();
    }
  }
  SimulatedTurns(const SimulatedTurns&) = delete;
  SimulatedTurns& operator=(const SimulatedTurns&) = delete;

  [[nodiscard]] std::vector<GyroscopeTurn>& turns() { return turns_; }

 private:
  std::vector<double> time_s_;
  std::vector<std::array<std::vector<double>, 3>> readings_;
  std::vector<GyroscopeTurn> turns_;
};

// Eight turns about random axes. The seats have errors of `error_rad` (sd).
std::vector<TurnAboutAxis> eight_turns(double error_rad, std::uint64_t seed) {
  RandomStream random(seed);
  std::vector<TurnAboutAxis> turns;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d axis = random.normals<3>().normalized();
    TurnAboutAxis turn{.rotation = (0.8 + 0.2 * i) * axis};
    turn.known = rotation_by(error_rad * random.normals<3>()) * rotation_by(turn.rotation);
    turns.push_back(turn);
  }
  return turns;
}

const RestFit exact_rests{.bias = gyroscope_bias};

TEST(TurnsAboutAxes, GiveTheSensitivityExactly) {
  SimulatedTurns simulated(eight_turns(0.0, 1));
  const TurnFit fit = fit_turns(simulated.turns(), exact_rests);
  EXPECT_TRUE(fit.converged);
  EXPECT_TRUE(fit.has_rotations);
  EXPECT_MATRIX_NEAR(fit.response.sensitivity, gyroscope_sensitivity(), 1e-6);
  EXPECT_NEAR(fit.most_revolutions, 2.2 / (2.0 * std::numbers::pi), 1e-3);
}

// One Gauss-Newton step from the truth with an analytical Jacobian: the mean rotation over the turn
// times the change of B.
struct LinearTurns {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd(24, 9);  // columns: entries of B, row by row
  Eigen::VectorXd residuals = Eigen::VectorXd(24);

  explicit LinearTurns(const std::vector<TurnAboutAxis>& turns) {
    for (Eigen::Index i = 0; i < 8; ++i) {
      const TurnAboutAxis& turn = turns[static_cast<std::size_t>(i)];
      const Eigen::Vector3d integral = gyroscope_sensitivity() * turn.rotation;
      constexpr int parts = 400;
      Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
      for (int p = 0; p < parts; ++p) {
        mean += rotation_by((p + 0.5) / parts * turn.rotation) / parts;
      }
      for (Eigen::Index p = 0; p < 3; ++p) {
        for (Eigen::Index q = 0; q < 3; ++q) {
          jacobian.block<3, 1>(3 * i, 3 * p + q) = mean.col(p) * integral(q);
        }
      }
      residuals.segment<3>(3 * i) =
          turn_vector(turn.known * rotation_by(turn.rotation).transpose());
    }
  }
};

TEST(TurnsAboutAxes, AgreeWithLinearLeastSquares) {
  constexpr double error_rad = 1e-4;
  const std::vector<TurnAboutAxis> turns = eight_turns(error_rad, 2);
  SimulatedTurns simulated(turns);
  const TurnFit fit = fit_turns(simulated.turns(), exact_rests, {.whole_budget = false});
  const LinearTurns linear(turns);
  const Eigen::VectorXd step = linear.jacobian.colPivHouseholderQr().solve(linear.residuals);
  const Eigen::Matrix3d B = gyroscope_sensitivity().inverse() + step.reshaped(3, 3).transpose();
  EXPECT_MATRIX_NEAR(fit.inverse, B, 2e-6);
  const double rss = (linear.residuals - linear.jacobian * step).squaredNorm();
  EXPECT_NEAR(fit.residual_sd_rad, std::sqrt(rss / 15.0), 0.02 * error_rad);
  EXPECT_EQ(fit.residuals.size(), 8U);
  // dS = -S dB S.
  const Eigen::MatrixXd C = rss / 15.0 * (linear.jacobian.transpose() * linear.jacobian).inverse();
  for (Eigen::Index k = 0; k < 3; ++k) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      Eigen::VectorXd change(9);
      for (Eigen::Index p = 0; p < 3; ++p) {
        for (Eigen::Index q = 0; q < 3; ++q) {
          change(3 * p + q) = -gyroscope_sensitivity()(k, p) * gyroscope_sensitivity()(q, j);
        }
      }
      const double variance = change.dot(C * change);
      EXPECT_NEAR(fit.covariance(4 * k + 1 + j, 4 * k + 1 + j), variance, 0.05 * variance);
    }
  }
}

TEST(TurnsAboutAxes, FollowTheUnitOfReadings) {
  const std::vector<TurnAboutAxis> turns = eight_turns(1e-3, 3);
  SimulatedTurns plain(turns);
  SimulatedTurns scaled(turns, 250.0);
  const TurnFit a = fit_turns(plain.turns(), exact_rests);
  const TurnFit b = fit_turns(scaled.turns(), {.bias = 250.0 * gyroscope_bias});
  EXPECT_MATRIX_NEAR(b.response.sensitivity / 250.0, a.response.sensitivity, 1e-8);
  EXPECT_NEAR(b.residual_sd_rad, a.residual_sd_rad, 1e-8);
}

// If the seats are stated in a frame turned by Q, the fitted sensitivity is S Q^T.
TEST(TurnsAboutAxes, FollowTheFrameOfTheSeats) {
  const std::vector<TurnAboutAxis> turns = eight_turns(1e-3, 4);
  const Eigen::Matrix3d Q = rotation_by(Eigen::Vector3d(0.02, -0.03, 0.05));
  SimulatedTurns plain(turns);
  SimulatedTurns turned(turns, 1.0, Q);
  const TurnFit a = fit_turns(plain.turns(), exact_rests);
  const TurnFit b = fit_turns(turned.turns(), exact_rests);
  EXPECT_MATRIX_NEAR(b.response.sensitivity, a.response.sensitivity * Q.transpose(), 1e-7);
}

TEST(TurnsAboutAxes, FindTheBiasTooIfAsked) {
  SimulatedTurns simulated(eight_turns(0.0, 5));
  const RestFit wrong{.bias = gyroscope_bias + Eigen::Vector3d(0.01, 0.02, -0.01)};
  const TurnFit fit = fit_turns(simulated.turns(), wrong, {.fit_bias = true});
  EXPECT_MATRIX_NEAR(fit.response.bias, gyroscope_bias, 1e-6);
  EXPECT_MATRIX_NEAR(fit.response.sensitivity, gyroscope_sensitivity(), 1e-6);
}

TEST(TurnsAboutAxes, NeedAsManySharedErrorsEach) {
  SimulatedTurns simulated(eight_turns(1e-3, 6));
  for (GyroscopeTurn& turn : simulated.turns()) {
    turn.errors_before = turn.errors_after = Eigen::Matrix3Xd::Zero(3, 2);
  }
  simulated.turns()[3].errors_after = Eigen::Matrix3Xd::Zero(3, 1);
  EXPECT_THAT(test::complaint_of<DomainError>(
                  [&] { static_cast<void>(fit_turns(simulated.turns(), exact_rests)); }),
              HasSubstr("same number of shared errors"));
}

TEST(TurnCalibration, IsTheRecordOfTheFit) {
  SimulatedTurns simulated(eight_turns(1e-3, 7));
  TurnFit fit = fit_turns(simulated.turns(), exact_rests);
  Instrument gyroscope;
  gyroscope.kind = "gyroscope";
  gyroscope.axes = {"gx", "gy", "gz"};
  gyroscope.unit = "rad/s";
  const Eigen::Vector3d rest_sd(1e-4, 2e-4, 3e-4);
  const Calibration record = turn_calibration(fit, gyroscope, rest_sd);
  EXPECT_EQ(record.fit.method, Method::turns);
  EXPECT_EQ(record.sensor.field.kind, "induced_rotation");
  EXPECT_MATRIX_NEAR(record.sensor.response.sensitivity, fit.response.sensitivity, 0.0);
  EXPECT_MATRIX_NEAR(record.fit.statistics->residual_sd, rest_sd, 0.0);
  EXPECT_EQ(record.fit.statistics->parameter_names[5], "gy.sensitivity.x");
  EXPECT_NEAR(record.parameter("gy.sensitivity.x").value, fit.response.sensitivity(1, 0), 1e-15);
  EXPECT_THAT(record.findings.notes, test::HasNote(HasSubstr("8 turns between known seats")));
  EXPECT_TRUE(record.findings.warnings.empty());
  fit.converged = false;
  fit.most_revolutions = 33.0;
  const Calibration doubtful = turn_calibration(fit, gyroscope, rest_sd);
  ASSERT_EQ(doubtful.findings.warnings.size(), 2U);
  EXPECT_EQ(doubtful.findings.warnings[0].code, WarningCode::not_converged);
  EXPECT_EQ(doubtful.findings.warnings[1].code, WarningCode::many_revolutions);
}

// ---- rests ----

Eigen::MatrixX3d directions_up(Eigen::Index n, std::uint64_t seed) {
  RandomStream random(seed, 2);
  Eigen::MatrixX3d ups(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    ups.row(i) = random.normals<3>().normalized().transpose();
  }
  return ups;
}

TEST(FitRests, OfAFewAreTheirMean) {
  Eigen::MatrixX3d means(4, 3);
  means << 1.0, 2.0, 3.0, 1.5, 2.0, 2.0, 0.5, 2.0, 4.0, 1.0, 2.0, 3.0;
  const RestFit fit = fit_rests(means, directions_up(4, 1));
  EXPECT_MATRIX_NEAR(fit.bias, Eigen::Vector3d(1.0, 2.0, 3.0), 1e-15);
  EXPECT_MATRIX_NEAR(fit.sd, Eigen::Vector3d(std::sqrt(0.5 / 3.0), 0.0, std::sqrt(2.0 / 3.0)),
                     1e-15);
  EXPECT_NEAR(fit.bias_covariance(2, 2), 2.0 / 3.0 / 4.0, 1e-15);
  EXPECT_EQ(fit.degrees_of_freedom, 3.0);
  EXPECT_FALSE(fit.g_sensitivity.has_value());
}

TEST(FitRests, FindTheSensitivityToGravity) {
  constexpr Eigen::Index n = 20;
  const Eigen::MatrixX3d ups = directions_up(n, 2);
  RandomStream random(3);
  Eigen::Matrix3d G = Eigen::Matrix3d::Zero();
  G(0, 0) = 0.05;
  Eigen::MatrixX3d means = ups * G.transpose();
  for (double& one : means.reshaped()) {
    one += 1e-3 * random.normal();
  }
  const RestFit fit = fit_rests(means, ups);
  ASSERT_TRUE(fit.g_sensitivity.has_value());
  Eigen::MatrixXd X(n, 4);
  X << Eigen::VectorXd::Ones(n), ups;
  const Eigen::MatrixXd x = X.colPivHouseholderQr().solve(means);
  EXPECT_MATRIX_NEAR(*fit.g_sensitivity, Eigen::Matrix3d(x.bottomRows<3>().transpose()), 1e-12);
  const Eigen::VectorXd left = means.col(1) - X * x.col(1);
  const Eigen::MatrixXd C = left.squaredNorm() / 16.0 * (X.transpose() * X).inverse();
  EXPECT_NEAR((*fit.g_sensitivity_se)(1, 2), std::sqrt(C(3, 3)), 1e-10);
  EXPECT_LT(fit.p_value(0), 1e-6);
  EXPECT_GT(fit.p_value(1), 1e-3);
}

TEST(FitRests, OfDriftingBiasesAreThoseOfTheMiddle) {
  constexpr Eigen::Index n = 30;
  RandomStream random(4);
  Eigen::MatrixX3d means(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double progress = static_cast<double>(i) / (n - 1) - 0.5;
    means.row(i) = Eigen::RowVector3d(0.1, 0.2, 0.3) +
                   0.05 * progress * Eigen::RowVector3d::Ones() +
                   1e-3 * random.normals<3>().transpose();
  }
  const RestFit fit = fit_rests(means, directions_up(n, 4));
  EXPECT_THAT(fit.remark, HasSubstr("change over the log"));
  EXPECT_MATRIX_NEAR(fit.bias, Eigen::Vector3d(0.1, 0.2, 0.3), 2e-3);
  // The scatter is about the line. That about the mean would be 0.015.
  EXPECT_LT(fit.sd.maxCoeff(), 2e-3);
}

TEST(FitRests, OfWhiteNoiseHaveNoRemark) {
  int remarks = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    RandomStream random(seed);
    Eigen::MatrixX3d means(20, 3);
    for (double& one : means.reshaped()) {
      one = random.normal();
    }
    remarks += fit_rests(means, directions_up(20, seed)).remark.empty() ? 0 : 1;
  }
  EXPECT_LE(remarks, 14);  // expected: 5, by the 10 % test
}

}  // namespace
}  // namespace axiscal
