// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/jackknife.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

Eigen::MatrixXd line_design(Eigen::Index n) {
  Eigen::MatrixXd X(n, 2);
  X.col(0).setOnes();
  X.col(1) = Eigen::VectorXd::LinSpaced(n, -1.0, 1.0);
  return X;
}

Eigen::VectorXd correlated(Eigen::Index n, double rho, RandomStream& random) {
  Eigen::VectorXd e(n);
  double last = random.normal();
  for (Eigen::Index i = 0; i < n; ++i) {
    e(i) = last;
    last = rho * last + std::sqrt(1.0 - rho * rho) * random.normal();
  }
  return e;
}

// In a linear problem one step without a tenth of the rows equals a refit without them.
TEST(Jackknife, LeavesTenthsOutAsFitsOfTheirOwnWould) {
  RandomStream random(3);
  const Eigen::MatrixXd X = line_design(57);
  const Eigen::VectorXd y = correlated(57, 0.5, random);
  const LeastSquaresFit all = LeastSquaresDesign(X).fit(y);
  const Eigen::MatrixXd changes =
      block_jackknife_changes({.residuals = -all.residuals, .jacobian = X});
  ASSERT_EQ(changes.cols(), 10);
  for (Eigen::Index part = 0; part < 10; ++part) {
    Eigen::VectorXd w = Eigen::VectorXd::Ones(57);
    const Eigen::Index first = 57 * part / 10;
    w.segment(first, 57 * (part + 1) / 10 - first).setZero();
    const LeastSquaresFit without = LeastSquaresDesign(X, w).fit(y);
    EXPECT_MATRIX_NEAR(changes.col(part), without.estimate - all.estimate, 1e-12);
  }
}

// The variance is 0.9 times the sum of squares about the mean (Kuensch 1989).
TEST(Jackknife, SaysTheUncertaintyOfAMean) {
  Eigen::MatrixXd changes(1, 10);
  changes << 1, -1, 1, -1, 1, -1, 1, -1, 1, -1;
  EXPECT_NEAR(jackknife_uncertainty(changes)(0), 3.0, 1e-12);
}

TEST(Jackknife, IsNoNumberWhereAPartAloneDeterminesSomething) {
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(40, 2);
  X.col(0).setOnes();
  X(1, 1) = 1.0;
  const Eigen::MatrixXd changes =
      block_jackknife_changes({.residuals = Eigen::VectorXd::Ones(40), .jacobian = X});
  EXPECT_FALSE(changes.col(0).allFinite());
}

TEST(RescaledCovariance, KeepsCorrelations) {
  Eigen::Matrix3d C;
  C << 4.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0;
  const Eigen::MatrixXd scaled = rescaled_covariance(C, Eigen::Vector3d(4.0, 3.0, 7.0));
  EXPECT_NEAR(scaled(0, 0), 16.0, 1e-12);
  EXPECT_NEAR(scaled(0, 1), 6.0, 1e-12);
  EXPECT_EQ(scaled(2, 2), 0.0);
}

// The correlation length of AR(1) is (1 + rho) / (1 - rho).
TEST(CorrelationLength, IsThatOfAnAutoregression) {
  RandomStream random(7);
  EXPECT_NEAR(correlation_length(correlated(200000, 0.8, random)), 9.0, 1.5);
  EXPECT_LT(correlation_length(correlated(20000, 0.0, random)), 3.0);
  EXPECT_EQ(correlation_length(Eigen::VectorXd::Zero(100)), 1.0);
  EXPECT_EQ(correlation_length(Eigen::VectorXd::Ones(160)), 16.0);  // the upper limit
}

}  // namespace
}  // namespace axiscal
