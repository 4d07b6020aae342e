// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/turns.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/logs/simulate_log.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

LinearResponse some_gyroscope() {
  Eigen::Matrix3d S;
  S << 1.02, 0.01, -0.02, 0.015, 0.97, 0.01, -0.01, 0.02, 1.01;
  return {.bias = Eigen::Vector3d(12.0, -7.0, 30.0), .sensitivity = 3754.0 * S};
}

// Simulated samples of turns between random attitudes, and the attitudes.
struct Turning {
  RecordedLog log;
  std::vector<Eigen::Matrix3d> attitudes;
  std::vector<GyroscopeTurn> turns;
};

Turning turn_by_hand(std::size_t rests, double noise, bool with_rotations, std::uint64_t seed) {
  ImuSimulation simulation{
      .accelerometer = LinearResponse{.bias = Eigen::Vector3d::Zero(),
                                      .sensitivity = Eigen::Matrix3d::Identity()},
      .gyroscope = some_gyroscope(),
      .gyroscope_sd = noise,
      .rest_s = 0.5,
      .seed = seed};
  Turning turning{.attitudes = random_attitudes(rests, seed)};
  turning.log = simulate_imu_log(simulation, turning.attitudes);
  constexpr std::size_t resting = 50;
  constexpr std::size_t moving = 149;
  for (std::size_t i = 0; i + 1 < rests; ++i) {
    const std::size_t first = i * (resting + moving) + resting - 1;
    GyroscopeTurn& turn = turning.turns.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      turn.readings[axis] = std::span(turning.log.samples[4 + axis]).subspan(first, moving + 2);
    }
    turn.time_s = std::span(turning.log.samples[0]).subspan(first, moving + 2);
    turn.up_before = turning.attitudes[i].transpose().col(2);
    turn.up_after = turning.attitudes[i + 1].transpose().col(2);
    if (with_rotations) {
      turn.rotation_before_from_after = turning.attitudes[i].transpose() * turning.attitudes[i + 1];
    }
  }
  return turning;
}

// Turns without noise at 100 Hz, with and without seats, with known and with fitted bias.
TEST(FitTurns, IsExactWithoutNoise) {
  const LinearResponse truth = some_gyroscope();
  for (const bool with_rotations : {false, true}) {
    for (const bool fit_bias : {false, true}) {
      const Turning turning = turn_by_hand(14, 0.0, with_rotations, 3);
      Eigen::Vector3d bias = truth.bias;
      if (fit_bias) {
        bias += Eigen::Vector3d(20.0, -10.0, 5.0);
      }
      const TurnFit fit = fit_turns(turning.turns, {.bias = bias}, {.fit_bias = fit_bias});
      EXPECT_EQ(fit.has_rotations, with_rotations);
      EXPECT_MATRIX_NEAR(fit.response.sensitivity, truth.sensitivity, 2e-2);
      EXPECT_MATRIX_NEAR(fit.response.bias, truth.bias, 1e-2);
      EXPECT_LT(fit.residual_sd_rad, 1e-6);
      const std::vector<Eigen::Matrix3d> rotations = integrated_rotations(turning.turns, fit);
      EXPECT_MATRIX_NEAR(rotations[2],
                         Eigen::Matrix3d(turning.attitudes[2].transpose() * turning.attitudes[3]),
                         1e-6);
    }
  }
}

// The stated covariance agrees with the errors, and 95 % intervals cover the truth.
TEST(FitTurns, StatesItsUncertainty) {
  const LinearResponse truth = some_gyroscope();
  for (const bool with_rotations : {false, true}) {
    constexpr int runs = 150;
    double squares = 0.0;
    for (std::uint64_t seed = 1; seed <= runs; ++seed) {
      const Turning turning = turn_by_hand(20, 20.0, with_rotations, seed);
      RandomStream random(seed, 9);
      const double bias_sd = 1.0;
      const Eigen::Vector3d bias = truth.bias + bias_sd * random.normals<3>();
      const TurnFit fit = fit_turns(
          turning.turns,
          {.bias = bias, .bias_covariance = bias_sd * bias_sd * Eigen::Matrix3d::Identity()},
          {.rate_per_unit = 1.0 / 3754.0});
      for (int k = 0; k < 3; ++k) {
        for (int j = 0; j < 3; ++j) {
          const double error = fit.response.sensitivity(k, j) - truth.sensitivity(k, j);
          squares += error * error / fit.covariance(4 * k + 1 + j, 4 * k + 1 + j) / 9.0 / runs;
        }
      }
    }
    // The mean of 150 x 9 squared normalised errors. After the correction for the degrees of
    // freedom it is 1 +- 0.06.
    EXPECT_NEAR(squares, 1.05, 0.18) << with_rotations;
  }
}

// The Earth turns by 0.04 degrees in ten seconds. If its rotation is stated, it does not change the
// scale factors.
TEST(FitTurns, TakesOutTheRotationOfTheEarth) {
  Turning turning = turn_by_hand(14, 0.0, true, 5);
  const LinearResponse truth = some_gyroscope();
  const Eigen::Vector3d earth_in_table(0.0, 2e-3, 1e-3);  // 30 times the real rate
  std::vector<std::array<std::vector<double>, 3>> readings(turning.turns.size());
  for (std::size_t i = 0; i < turning.turns.size(); ++i) {
    GyroscopeTurn& turn = turning.turns[i];
    turn.earth_rate_in_sensor = turning.attitudes[i].transpose() * earth_in_table;
    // The table turns with the Earth, and the seats are relative to the table.
    const TurnFit exact{.response = truth, .inverse = Eigen::Matrix3d(truth.sensitivity).inverse()};
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      readings[i][axis].assign(turn.readings[axis].begin(), turn.readings[axis].end());
    }
    for (std::size_t s = 0; s < turn.time_s.size(); ++s) {
      const Eigen::Vector3d w =
          exact.inverse *
          (Eigen::Vector3d(turn.readings[0][s], turn.readings[1][s], turn.readings[2][s]) -
           truth.bias);
      if (s > 0) {
        const Eigen::Vector3d step = w * (turn.time_s[s] - turn.time_s[s - 1]);
        R = R * Eigen::AngleAxisd(step.norm(), step.normalized()).toRotationMatrix();
      }
      const Eigen::Vector3d more = truth.sensitivity * (R.transpose() * turn.earth_rate_in_sensor);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        readings[i][axis][s] += more(static_cast<Eigen::Index>(axis));
      }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      turn.readings[axis] = readings[i][axis];
    }
  }
  const TurnFit with = fit_turns(turning.turns, {.bias = truth.bias});
  for (GyroscopeTurn& turn : turning.turns) {
    turn.earth_rate_in_sensor.setZero();
  }
  const TurnFit without = fit_turns(turning.turns, {.bias = truth.bias});
  EXPECT_LT(with.residual_sd_rad, 0.05 * without.residual_sd_rad);
  EXPECT_GT(without.residual_sd_rad, 5e-4);
}

// If the times are in another unit, a scale fits that has whole revolutions in excess.
TEST(FitTurns, RefusesRevolutionsThatNoHandMakes) {
  Turning turning = turn_by_hand(14, 0.5, false, 3);
  const LinearResponse truth = some_gyroscope();
  EXPECT_LT(fit_turns(turning.turns, {.bias = truth.bias}).most_revolutions, 2.0);
  // Turns with the same ends and 40 more revolutions each, with and without a stated scale.
  std::vector<std::vector<double>> owned;
  owned.reserve(3 * turning.turns.size());
  for (GyroscopeTurn& turn : turning.turns) {
    const double duration_s = turn.time_s.back() - turn.time_s.front();
    const Eigen::Vector3d rate =
        truth.sensitivity * (2.0 * std::numbers::pi * 40.0 / duration_s * Eigen::Vector3d::UnitZ());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      owned.emplace_back(turn.readings[axis].begin(), turn.readings[axis].end());
      for (double& value : owned.back()) {
        value += rate(static_cast<Eigen::Index>(axis));
      }
      turn.readings[axis] = owned.back();
    }
  }
  try {
    const TurnFit fit = fit_turns(turning.turns, {.bias = truth.bias});
    ADD_FAILURE() << fit.most_revolutions << " revolutions were taken";
  } catch (const RefusedError& error) {
    EXPECT_THAT(error.what(),
                testing::AnyOf(HasSubstr("by hand. Check whether"),
                               HasSubstr("the turns do not fit any scale of the gyroscope")));
  }
}

TEST(FitTurns, SaysWhatIsMissing) {
  const Turning few = turn_by_hand(4, 0.0, false, 3);
  EXPECT_THAT(test::complaint_of<RefusedError>([&] {
                static_cast<void>(fit_turns(few.turns, {.bias = some_gyroscope().bias}));
              }),
              HasSubstr("3 turns are too few"));
  Turning turning = turn_by_hand(14, 0.0, false, 3);
  std::vector<GyroscopeTurn> swapped = turning.turns;
  for (GyroscopeTurn& turn : swapped) {
    std::swap(turn.readings[0], turn.readings[1]);
  }
  EXPECT_THAT(test::complaint_of<RefusedError>([&] {
                static_cast<void>(fit_turns(swapped, {.bias = some_gyroscope().bias},
                                            {.rate_per_unit = 1.0 / 3754.0}));
              }),
              HasSubstr("Check whether the order and signs"));
}

// The sensor is turned about one axis only, so only its scale factor is determined.
TEST(FitTurns, NamesTheAxesThatWereNotTurned) {
  std::vector<Eigen::Matrix3d> attitudes;
  for (int i = 0; i < 14; ++i) {
    attitudes.emplace_back(Eigen::AngleAxisd(1.3 * i, Eigen::Vector3d::UnitX()).toRotationMatrix());
  }
  ImuSimulation simulation{
      .accelerometer = LinearResponse{.bias = Eigen::Vector3d::Zero(),
                                      .sensitivity = Eigen::Matrix3d::Identity()},
      .gyroscope = LinearResponse{.bias = Eigen::Vector3d::Zero(),
                                  .sensitivity = Eigen::Matrix3d::Identity()},
      .gyroscope_sd = 0.0,
      .rest_s = 0.5};
  const RecordedLog log = simulate_imu_log(simulation, attitudes);
  std::vector<GyroscopeTurn> turns;
  for (std::size_t i = 0; i + 1 < attitudes.size(); ++i) {
    const std::size_t first = i * 199 + 49;
    GyroscopeTurn& turn = turns.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      turn.readings[axis] = std::span(log.samples[4 + axis]).subspan(first, 151);
    }
    turn.time_s = std::span(log.samples[0]).subspan(first, 151);
    turn.rotation_before_from_after = attitudes[i].transpose() * attitudes[i + 1];
  }
  try {
    static_cast<void>(fit_turns(turns, {}));
    FAIL() << "must be refused";
  } catch (const RankDeficientError& error) {
    EXPECT_THAT(error.what(), HasSubstr("z.sensitivity.z"));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("x.sensitivity.x")));
    EXPECT_THAT(error.what(), HasSubstr("turn the instrument about each of its axes"));
  }
}

}  // namespace
}  // namespace axiscal
