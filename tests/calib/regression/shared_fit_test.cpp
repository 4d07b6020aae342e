// SPDX-License-Identifier: Apache-2.0
// Responses with shared coefficients, compared with dense generalised least squares.
#include "calib/regression/shared_fit.hpp"

#include <cmath>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/core/random.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

struct Response {
  Eigen::MatrixXd P;
  Eigen::VectorXd y;
};

std::vector<Response> three_responses(std::uint32_t seed) {
  RandomStream random(seed, 0);
  std::vector<Response> all;
  for (const double sigma : {0.5, 1.0, 4.0}) {
    Response& one = all.emplace_back();
    one.P = Eigen::MatrixXd(20, 2);
    one.y = Eigen::VectorXd(20);
    for (Eigen::Index i = 0; i < 20; ++i) {
      one.P.row(i) << random.normal(), 1e-4 * random.normal();
      one.y(i) = one.P.row(i).dot(Eigen::RowVector2d(1.5, -3e4)) + sigma * random.normal();
    }
  }
  return all;
}

SharedSums sums_of(const std::vector<Response>& responses) {
  SharedSums sums(2, std::ssize(responses));
  for (Eigen::Index k = 0; k < sums.responses(); ++k) {
    const Response& one = responses[static_cast<std::size_t>(k)];
    sums.information_of(k) = one.P.transpose() * one.P;
    sums.gradient.col(k) = one.P.transpose() * one.y;
    sums.squares(k) = one.y.squaredNorm();
    sums.degrees_of_freedom(k) = 16.0;
  }
  return sums;
}

TEST(SharedFit, IsWhereEachVarianceIsWhatItsResidualsLeave) {
  const std::vector<Response> responses = three_responses(5);
  const auto fit = fit_shared(sums_of(responses), Eigen::Vector3d::Ones(), Eigen::Vector3d::Zero());
  ASSERT_TRUE(fit);
  Eigen::Matrix2d N = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Response& one = responses[static_cast<std::size_t>(k)];
    N += one.P.transpose() * one.P / fit->variance(k);
    right += one.P.transpose() * one.y / fit->variance(k);
  }
  const Eigen::Vector2d z = N.fullPivLu().solve(right);
  EXPECT_LT((fit->estimate - z).cwiseQuotient(z).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((fit->covariance * N - Eigen::Matrix2d::Identity()).norm(), 1e-6);
  double used = 0.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Response& one = responses[static_cast<std::size_t>(k)];
    const double share = (N.inverse() * one.P.transpose() * one.P).trace() / fit->variance(k);
    EXPECT_NEAR(fit->degrees_of_freedom(k), 16.0 - share, 1e-7);
    EXPECT_NEAR((one.y - one.P * z).squaredNorm() / fit->degrees_of_freedom(k), fit->variance(k),
                1e-6 * fit->variance(k));
    used += share;
  }
  EXPECT_NEAR(used, 2.0, 1e-7);
}

TEST(SharedFit, TakesNoVarianceBelowTheSmallest) {
  const auto fit = fit_shared(sums_of(three_responses(6)), Eigen::Vector3d::Ones(),
                              Eigen::Vector3d(0.0, 9.0, 0.0));
  ASSERT_TRUE(fit);
  EXPECT_DOUBLE_EQ(fit->variance(1), 9.0);
  EXPECT_LT(fit->variance(0), 1.0);
}

TEST(SharedFit, SaysWhenNothingDeterminesWhatIsShared) {
  std::vector<Response> responses = three_responses(7);
  for (Response& one : responses) {
    one.P.col(1) = 2e-4 * one.P.col(0);
  }
  EXPECT_FALSE(fit_shared(sums_of(responses), Eigen::Vector3d::Ones(), Eigen::Vector3d::Zero()));
}

TEST(SharedFit, FitsVariancesWhereNothingIsShared) {
  SharedSums sums(0, 3);
  sums.squares = sums_of(three_responses(8)).squares;
  sums.degrees_of_freedom.setConstant(16.0);
  const auto fit = fit_shared(sums, Eigen::Vector3d::Ones(), Eigen::Vector3d::Zero());
  ASSERT_TRUE(fit);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double mean = sums.squares(k) / 16.0;
    EXPECT_NEAR(fit->variance(k), mean, 1e-9 * mean);
  }
}

TEST(PositiveFactor, SolvesAndJudgesWhateverTheUnits) {
  Eigen::Matrix3d A;
  A << 4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0;
  const Eigen::Vector3d units(1e-9, 1.0, 1e8);
  const Eigen::MatrixXd N = units.asDiagonal() * A * units.asDiagonal();
  const PositiveFactor cholesky(N);
  EXPECT_TRUE(cholesky.is_determined(0.5));
  EXPECT_FALSE(cholesky.is_determined(0.99));
  const Eigen::Vector3d inverse_units = units.cwiseInverse();
  const Eigen::MatrixXd expected =
      inverse_units.asDiagonal() * A.inverse() * inverse_units.asDiagonal();
  EXPECT_LT((cholesky.inverse() - expected).cwiseQuotient(expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(cholesky.log_determinant(), std::log(A.determinant()) + 2.0 * std::log(1e-1), 1e-9);
  Eigen::MatrixXd open = N;
  open.row(2) = open.row(1);
  open.col(2) = open.col(1);
  open(2, 2) = open(1, 1);
  EXPECT_FALSE(PositiveFactor(open).is_determined(1e-12));
}

}  // namespace
}  // namespace axiscal
