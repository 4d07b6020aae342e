// SPDX-License-Identifier: Apache-2.0
// Errors that the readings of one laying or of one pose share.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

constexpr double noise = 1e-5;

const ScatterComponent* component_of(const Calibration& calibration, const std::string& name) {
  const auto& all = calibration.fit.statistics->components;
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
  return found != all.end() ? &*found : nullptr;
}

// Runs of several blocks. Each pose has an error of `size` times the noise (sd), equal in all
// blocks. `seat_rad` is the rotation (sd) of the cube each time it is laid down.
struct PoseRuns {
  explicit PoseRuns(double size, double seat_rad = 0.0, int blocks = 4) {
    World world;
    world.seat_rad = seat_rad;
    const SensorModel truth = test::accelerometer_truth();
    const Experiment experiment = test::experiment_for(truth);
    for (std::uint64_t seed = 1; seed <= runs; ++seed) {
      Observations run = simulate(truth, make_run_sheet(standard_design(12), blocks, seed),
                                  {.noise_sd = noise, .world = world, .seed = seed});
      RandomStream random(seed, 7);
      std::map<DesignPoint, Eigen::RowVector3d> errors;
      for (const DesignEntry& entry : standard_design(12)) {
        errors.emplace(entry.point,
                       size * noise * Eigen::RowVector3d::NullaryExpr([&](Eigen::Index) {
                         return random.normal();
                       }));
      }
      for (Eigen::Index i = 0; i < run.size(); ++i) {
        run.response.row(i) += errors.at(*run.readings[static_cast<std::size_t>(i)].point);
      }
      const Calibration found = calibrate(experiment, run);
      told += component_of(found, "poses") != nullptr ? 1 : 0;
      for (const CalibrationWarning& warning : found.findings.warnings) {
        misnamed += warning.code != WarningCode::lack_of_fit ? 1 : 0;
      }
      for (Eigen::Index k = 0; k < 3; ++k) {
        const double error =
            found.sensor.response.sensitivity(k, k) - truth.response.sensitivity(k, k);
        covered += std::abs(error) <= found.fit.statistics->interval_95(4 * k + 1 + k) ? 1 : 0;
      }
    }
  }

  static constexpr std::uint64_t runs = 60;
  int told = 0;
  int misnamed = 0;  // warnings that name another cause
  int covered = 0;   // out of 3 * runs
};

TEST(ErrorsOfPoses, AreToldAndCounted) {
  const PoseRuns one(1.0);
  EXPECT_GE(one.told, 42);
  EXPECT_GE(one.covered, 157);  // at least 87 % of 180
}

// Seats explain errors of layings. They must not hide an error that repeats in all blocks.
TEST(ErrorsOfPoses, AreCountedBesideErrorsOfSeats) {
  const double noise_rad = noise / test::accelerometer_truth().response.sensitivity(0, 0);
  const PoseRuns both(2.0, 3.0 * noise_rad);
  EXPECT_GE(both.covered, 160);
}

// 96 readings contain only 12 independent errors. Tests of curvature, of saturation and of noise
// along the field therefore use the means of the poses.
TEST(ErrorsOfPoses, AreNotTakenForOtherCausesIfTheyAreLarge) {
  const PoseRuns large(5.0, 0.0, 8);
  EXPECT_EQ(large.told, PoseRuns::runs);
  EXPECT_LE(large.misnamed, 3);
  EXPECT_GE(large.covered, 164);
}

TEST(ErrorsOfPoses, AreNotSeenInWhiteReadings) {
  const PoseRuns none(0.0);
  EXPECT_LE(none.told, 5);
  EXPECT_GE(none.covered, 164);
}

// A logger writes five rows for each laying. The rows share the error of the laying, which is as
// large as the noise. Only the means are independent: they decide about curvature, about noise that
// differs along the field, and about correlated readings.
TEST(ErrorsOfLayings, RaiseNoAlarmsAndLeaveIntervalsValid) {
  const SensorModel truth = test::accelerometer_truth();
  const Experiment experiment = test::experiment_for(truth);
  constexpr int rows = 5;
  constexpr std::uint64_t runs = 150;
  int alarms = 0;
  int covered = 0;  // cross terms, out of 6 * runs
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const Observations once = simulate(truth, make_run_sheet(standard_design(12), 1, seed),
                                       {.noise_sd = noise, .seed = seed});
    RandomStream random(seed, 9);
    Observations run = once;
    run.readings.clear();
    run.response.resize(rows * once.size(), 3);
    for (Eigen::Index i = 0; i < run.response.rows(); ++i) {
      Reading reading = once.readings[static_cast<std::size_t>(i / rows)];
      reading.run = static_cast<int>(i) + 1;
      run.readings.push_back(reading);
      for (Eigen::Index k = 0; k < 3; ++k) {
        run.response(i, k) = once.response(i / rows, k) + noise * random.normal();
      }
    }
    const Calibration found = calibrate(experiment, run);
    alarms += found.findings.warnings.empty() ? 0 : 1;
    for (Eigen::Index k = 0; k < 3; ++k) {
      for (Eigen::Index j = 0; j < 3; ++j) {
        const double error =
            found.sensor.response.sensitivity(k, j) - truth.response.sensitivity(k, j);
        covered += j != k && std::abs(error) <= found.fit.statistics->interval_95(4 * k + 1 + j);
      }
    }
  }
  EXPECT_LE(alarms, 6);
  EXPECT_GE(covered, 828);  // 92 % of 900
}

// Five readings of each laying share one error, so the covariance is that of the 12 means.
TEST(ErrorsOfLayings, CountEachLayingOnce) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::known;
  experiment.fit.search_for_mistakes = false;
  Observations means = simulate(truth, make_run_sheet(standard_design(12), 1, 5),
                                {.noise_sd = 10.0 * noise, .seed = 5});
  constexpr int rows = 5;
  Observations run;
  run.response.resize(rows * means.size(), 3);
  RandomStream random(2, 9);
  for (Eigen::Index i = 0; i < means.size(); ++i) {
    Eigen::MatrixXd within =
        noise * Eigen::MatrixXd::NullaryExpr(
                    rows, 3, [&](Eigen::Index, Eigen::Index) { return random.normal(); });
    within.rowwise() -= within.colwise().mean().eval();
    for (int r = 0; r < rows; ++r) {
      run.readings.push_back(means.readings[static_cast<std::size_t>(i)]);
      run.readings.back().run = static_cast<int>(run.readings.size());
      run.response.row(rows * i + r) = means.response.row(i) + within.row(r);
    }
  }
  const Calibration of_means = calibrate(experiment, means);
  const Calibration of_rows = calibrate(experiment, run);
  ASSERT_NE(component_of(of_rows, "layings"), nullptr);
  for (Eigen::Index k = 0; k < 3; ++k) {
    for (const Eigen::Index j : {4 * k + 1, 4 * k + 2, 4 * k + 3}) {
      const double expected = of_means.fit.statistics->interval_95(j);
      EXPECT_GE(of_rows.fit.statistics->interval_95(j), 0.99 * expected);
      EXPECT_LE(of_rows.fit.statistics->interval_95(j), 2.0 * expected);
    }
  }
}

}  // namespace
}  // namespace axiscal
