// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/common_noise.hpp"

#include <gtest/gtest.h>

#include "axiscal/core/random.hpp"

namespace axiscal {
namespace {

// Normal noise in three columns, plus noise of sd `common` that is equal in all columns of a row.
Eigen::MatrixXd noise_of(int rows, double common, std::uint64_t seed) {
  RandomStream random(seed, 0);
  Eigen::MatrixXd noise(rows, 3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double shared = common * random.normal();
    for (Eigen::Index k = 0; k < 3; ++k) {
      noise(i, k) = shared + random.normal();
    }
  }
  return noise;
}

TEST(LossByCommonNoise, IsOneOnAverageIfResponsesAreIndependent) {
  double sum = 0.0;
  constexpr int runs = 200;
  for (int run = 0; run < runs; ++run) {
    sum += dof_reduction_factor(noise_of(20, 0.0, static_cast<std::uint64_t>(run)), 20.0);
  }
  EXPECT_GE(sum / runs, 1.0);
  EXPECT_LT(sum / runs, 1.1);
}

// Common noise of variance c^2 gives the correlation r = c^2 / (1 + c^2), and d = 1 + 2 r^2.
TEST(LossByCommonNoise, FollowsTheCorrelation) {
  for (const double common : {0.5, 1.0, 3.0}) {
    const double r = common * common / (1.0 + common * common);
    EXPECT_NEAR(dof_reduction_factor(noise_of(20000, common, 3), 20000.0), 1.0 + 2.0 * r * r, 0.03);
  }
}

TEST(LossByCommonNoise, IsOneIfThereIsNoNoiseOrNoFreedom) {
  EXPECT_EQ(dof_reduction_factor(Eigen::MatrixXd::Zero(5, 3), 5.0), 1.0);
  EXPECT_EQ(dof_reduction_factor(noise_of(5, 3.0, 1), 1.0), 1.0);
  EXPECT_EQ(dof_reduction_factor(noise_of(5, 3.0, 1).leftCols(1), 5.0), 1.0);
}

}  // namespace
}  // namespace axiscal
