// SPDX-License-Identifier: Apache-2.0
// Means over layings and over poses, computed here without the fit's code.
#include "calib/fit/layings.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// `blocks` blocks of 12 readings, with a shift of each block as a fitted effect.
struct Blocks {
  explicit Blocks(int blocks, double noise_sd = 1e-3) {
    std::vector<DesignEntry> design;
    for (int b = 0; b < blocks; ++b) {
      const std::vector<DesignEntry> one = standard_design(12);
      design.insert(design.end(), one.begin(), one.end());
    }
    set = test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                             design, noise_sd, 3);
    for (std::size_t i = 0; i < set.readings.size(); ++i) {
      set.readings[i].block = static_cast<int>(i) / 12 + 1;
    }
    set.effects = run_effects(set.readings, set.weights, {.blocks = true});
    estimate.response = test::some_response();
    estimate.effects = Eigen::MatrixXd::NullaryExpr(
        set.effects.columns.cols(), 3,
        [](Eigen::Index e, Eigen::Index k) { return 0.1 * static_cast<double>(1 + e + 2 * k); });
    set.response += set.effects.columns * estimate.effects;
  }

  ReadingSet set;
  Estimate estimate;
};

TEST(AveragePoses, AreMeansOverTheBlocksWithoutTheirShifts) {
  const Blocks run(3);
  const MeanReadings poses = average_poses(run.set, run.estimate);
  ASSERT_EQ(poses.set().size(), 12);
  EXPECT_EQ(poses.set().effects.columns.cols(), 0);
  Eigen::MatrixXd left = run.set.response - run.set.effects.columns * run.estimate.effects;
  for (Eigen::Index k = 0; k < 3; ++k) {
    double squares = 0.0;
    for (Eigen::Index i = 0; i < 12; ++i) {
      const double mean = (left(i, k) + left(12 + i, k) + left(24 + i, k)) / 3.0;
      EXPECT_NEAR(poses.set().response(i, k), mean, 1e-14);
      EXPECT_EQ(poses.set().weights(i, k), 3.0);
      for (const Eigen::Index j : {i, 12 + i, 24 + i}) {
        squares += std::pow(left(j, k) - mean, 2);
      }
    }
    EXPECT_NEAR(poses.squares(k), squares, 1e-12);
    EXPECT_EQ(poses.degrees_of_freedom(k), 22.0);  // 36 readings, 12 means, 2 shifts
  }
}

TEST(AveragePoses, WeighTheReadings) {
  Blocks run(2);
  run.set.weights(3, 1) = 3.0;
  run.set.weights(5, 2) = 0.0;
  const MeanReadings poses = average_poses(run.set, run.estimate);
  const Eigen::MatrixXd left = run.set.response - run.set.effects.columns * run.estimate.effects;
  EXPECT_NEAR(poses.set().response(3, 1), 0.75 * left(3, 1) + 0.25 * left(15, 1), 1e-14);
  EXPECT_NEAR(poses.set().response(5, 2), left(17, 2), 1e-14);
  EXPECT_EQ(poses.degrees_of_freedom, Eigen::Vector3d(11.0, 11.0, 10.0));
}

TEST(AveragePoses, AreTheReadingsIfNoPoseWasRepeated) {
  const Blocks run(1);
  const MeanReadings poses = average_poses(run.set, run.estimate);
  EXPECT_FALSE(poses.own.has_value());
  EXPECT_EQ(&poses.set(), &run.set);
  EXPECT_EQ(poses.degrees_of_freedom, Eigen::Vector3d::Zero().eval());
}

TEST(AveragePoses, AreTheReadingsIfTheMountOfAPoseChanged) {
  Blocks run(2);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX()).toRotationMatrix();
  run.set.rotation_sensor_from_table.put(14, turn * run.set.rotation_sensor_from_table[14]);
  EXPECT_FALSE(average_poses(run.set, run.estimate).own.has_value());
}

TEST(AverageLayings, KeepTheOrderAndTheEffects) {
  Blocks run(2);
  for (std::size_t i = 1; i < run.set.readings.size(); i += 2) {
    run.set.readings[i].point = run.set.readings[i - 1].point;
    run.set.rotation_sensor_from_table.put(i, run.set.rotation_sensor_from_table[i - 1]);
  }
  const MeanReadings layings = average_layings(run.set, run.estimate);
  ASSERT_EQ(layings.set().size(), 12);
  EXPECT_EQ(layings.set().effects.columns.cols(), run.set.effects.columns.cols());
  for (Eigen::Index s = 0; s < 12; ++s) {
    EXPECT_EQ(layings.set().readings[static_cast<std::size_t>(s)].run, 2 * s + 1);
    EXPECT_NEAR(layings.set().response(s, 0),
                0.5 * (run.set.response(2 * s, 0) + run.set.response(2 * s + 1, 0)), 1e-14);
  }
  EXPECT_EQ(layings.degrees_of_freedom, Eigen::Vector3d::Constant(12.0));
}

}  // namespace
}  // namespace axiscal
