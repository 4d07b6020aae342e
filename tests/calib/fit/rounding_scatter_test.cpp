// SPDX-License-Identifier: Apache-2.0
// Steps that are wider than the noise, and the variances of readings that share a digit.
#include "calib/fit/rounding_scatter.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/calib/distributions.hpp"
#include "calib/fit/src/causes/causes.hpp"
#include "calib/record/parameter_names.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// Readings at the 24 points, `times` times, rounded to `step`; a step of 0 means no rounding.
ReadingSet rounded_set(double step, double noise_sd, int times, std::uint64_t seed = 1) {
  std::vector<DesignEntry> design;
  for (int t = 0; t < times; ++t) {
    for (const DesignEntry& entry : standard_design(24)) {
      design.push_back(entry);
    }
  }
  ReadingSet set = test::labelled_set(
      test::some_response(), test::gravity_in_table({0.05, -0.03, 1.0}), design, noise_sd, seed);
  if (step > 0.0) {
    set.response = (set.response.array() / step).round() * step;
  }
  return set;
}

Eigen::Vector3d same_noise(double sd) {
  return Eigen::Vector3d::Constant(sd);
}

TEST(IsCoarselyRounded, ComparesTheStatedStepWithTheNoise) {
  const double step = 0.125;
  const ReadingSet set = rounded_set(step, 0.0, 1);
  EXPECT_TRUE(is_coarsely_rounded(set, step, same_noise(0.39 * step)));
  EXPECT_FALSE(is_coarsely_rounded(set, step, same_noise(0.41 * step)));
  EXPECT_TRUE(is_coarsely_rounded(set, step, same_noise(0.0)));
}

TEST(IsCoarselyRounded, IsTrueIfOneAxisIs) {
  const double step = 0.125;
  const ReadingSet set = rounded_set(step, 0.0, 1);
  EXPECT_TRUE(is_coarsely_rounded(set, step, Eigen::Vector3d(step, 0.1 * step, step)));
}

// A step that is not stated is used only if it is small against the range of the readings. A larger
// one could come from the differences of the field.
TEST(IsCoarselyRounded, FindsAStepThatNobodyStated) {
  const ReadingSet fine = rounded_set(0.03125, 0.0, 2);
  EXPECT_TRUE(is_coarsely_rounded(fine, 0.0, same_noise(0.004)));
  const ReadingSet coarse = rounded_set(0.25, 0.0, 2);
  EXPECT_FALSE(is_coarsely_rounded(coarse, 0.0, same_noise(0.03)));
  EXPECT_TRUE(is_coarsely_rounded(coarse, 0.25, same_noise(0.03)));
}

TEST(IsCoarselyRounded, IsFalseForReadingsWithoutSteps) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const ReadingSet set = rounded_set(0.0, 1e-3, 1, seed);
    EXPECT_FALSE(is_coarsely_rounded(set, 0.0, same_noise(1e-3)));
    // A stated step that the readings contradict is not used.
    EXPECT_FALSE(is_coarsely_rounded(set, 0.1, same_noise(1e-3)));
  }
}

TEST(IsCoarselyRounded, DoesNotDependOnTheUnit) {
  for (const double unit : {1e-6, 1.0, 4096.0}) {
    ReadingSet set = rounded_set(0.125, 0.0, 1);
    set.response *= unit;
    EXPECT_TRUE(is_coarsely_rounded(set, 0.125 * unit, same_noise(0.02 * unit))) << unit;
    EXPECT_FALSE(is_coarsely_rounded(set, 0.125 * unit, same_noise(0.1 * unit))) << unit;
  }
}

TEST(IsCoarselyRounded, PassesOverReadingsOfWeightZero) {
  ReadingSet set = rounded_set(0.125, 0.0, 1);
  set.response.row(3).array() += 0.0417;
  EXPECT_FALSE(is_coarsely_rounded(set, 0.125, same_noise(0.02)));
  set.weights.row(3).setZero();
  EXPECT_TRUE(is_coarsely_rounded(set, 0.125, same_noise(0.02)));
}

// ---- the cause ----

Estimate counted_by_rounding(const ReadingSet& set, double step) {
  const TableField field = test::gravity_in_table({0.05, -0.03, 1.0});
  Estimate estimate = estimate_known(set, field);
  fill_intervals(estimate.statistics);
  Experiment experiment;
  experiment.stated.resolution = step;
  const SolvedReadings readings(set, true);
  const std::map<int, Eigen::Matrix3d> mounts;
  return rounding_cause()
      .counted({.experiment = experiment,
                .fitted = readings,
                .judged = readings,
                .method = method_kind(Method::known),
                .mounts = mounts},
               {.estimate = estimate, .weighed = {}})
      .estimate;
}

// The scatter is that of the means of the poses. Means that differ by less than half a step share
// an error of variance q^2 / 12.
TEST(RoundingScatter, IsThatOfPosesThatShareDigits) {
  const double step = 0.125;
  const ReadingSet set = rounded_set(step, 0.01, 3, 4);
  const Estimate counted = counted_by_rounding(set, step);
  const TableField field = test::gravity_in_table({0.05, -0.03, 1.0});
  const Estimate before = estimate_known(set, field);
  const Eigen::MatrixXd X = test::rows_of(set, {0.05, -0.03, 1.0}).topRows(24);
  const Eigen::MatrixXd G = (X.transpose() * X).inverse() * X.transpose();
  int wider = 0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd v = set.response.col(k);
    const Eigen::VectorXd mean = (v.head(24) + v.segment(24, 24) + v.tail(24)) / 3.0;
    const double of_step = step * step / 12.0;
    const double s2 = std::max((mean - X * (G * mean)).squaredNorm() / 20.0, of_step);
    for (Eigen::Index j = 0; j < 4; ++j) {
      double shared = 0.0;
      for (Eigen::Index a = 0; a < 24; ++a) {
        for (Eigen::Index b = 0; b < 24; ++b) {
          if (std::abs(mean(a) - mean(b)) < 0.5 * step) {
            shared += of_step * G(j, a) * G(j, b);
          }
        }
      }
      const double variance = std::max(s2 * G.row(j).squaredNorm(), shared);
      const Eigen::Index p = 4 * k + j;
      const double old_variance = before.statistics.covariance(p, p);
      const double interval =
          std::max(student_t_factor(0.95, 20.0) * std::sqrt(variance),
                   student_t_factor(0.95, before.statistics.degrees_of_freedom(k)) *
                       std::sqrt(old_variance));
      EXPECT_NEAR(counted.statistics.interval_95(p), interval, 1e-9) << k << j;
      EXPECT_NEAR(counted.statistics.covariance(p, p), std::max(variance, old_variance), 1e-12);
      wider += variance > old_variance ? 1 : 0;
    }
  }
  EXPECT_GE(wider, 6);
  ASSERT_EQ(counted.statistics.components.size(), 1U);
  EXPECT_MATRIX_NEAR(counted.statistics.components[0].sd,
                     Eigen::Vector3d::Constant(step / std::sqrt(12.0)), 1e-12);
  EXPECT_THAT(counted.notes, test::HasNote(testing::HasSubstr("axis x, y, z")));
}

// If the noise is as large as the step, repeats average the rounding error, and there is no
// component.
TEST(RoundingScatter, IsNoneIfNoiseDithers) {
  const double step = 0.01;
  const ReadingSet set = rounded_set(step, step, 3, 5);
  const Estimate counted = counted_by_rounding(set, step);
  EXPECT_TRUE(counted.statistics.components.empty());
  EXPECT_TRUE(counted.notes.empty());
}

TEST(RoundingScatter, IsNotCountedByRobustRegression) {
  ReadingSet set = rounded_set(0.125, 0.01, 3, 6);
  set.robust = true;
  EXPECT_TRUE(counted_by_rounding(set, 0.125).statistics.components.empty());
}

// The intervals contain the true bias in 60 runs with different biases.
TEST(RoundingScatter, CoversTheErrorOfTheBias) {
  const double step = 0.125;
  int covered = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    RandomStream random(seed);
    LinearResponse truth = test::some_response();
    truth.bias += step * random.normals<3>();
    std::vector<DesignEntry> design = standard_design(24);
    ReadingSet set =
        test::labelled_set(truth, test::gravity_in_table({0.05, -0.03, 1.0}), design, 1e-3, seed);
    set.response = (set.response.array() / step).round() * step;
    const Estimate counted = counted_by_rounding(set, step);
    for (Eigen::Index k = 0; k < 3; ++k) {
      covered +=
          std::abs(counted.response.bias(k) - truth.bias(k)) < counted.statistics.interval_95(4 * k)
              ? 1
              : 0;
    }
  }
  EXPECT_GE(covered, 162);  // out of 180
}

}  // namespace
}  // namespace axiscal
