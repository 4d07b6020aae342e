// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/serial_correlation.hpp"

#include <cmath>

#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

OrderedReadings noise_of(Eigen::Index n, double rho, RandomStream& random) {
  OrderedReadings readings;
  readings.responses.resize(n, 3);
  Eigen::MatrixXd X(n, 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    X.row(i) << 1.0, random.normal(), random.normal(), random.normal();
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double fresh = random.normal();
      readings.responses(i, k) =
          i == 0 ? fresh : rho * readings.responses(i - 1, k) + std::sqrt(1.0 - rho * rho) * fresh;
    }
  }
  readings.designs.assign(3, X);
  readings.places = Eigen::VectorXd::LinSpaced(n, 0.0, static_cast<double>(n - 1));
  return readings;
}

// Against the definition with whole matrices: Q = P A P.
TEST(LagOneScore, IsTheRatioOfQuadraticForms) {
  RandomStream random(3);
  OrderedReadings one = noise_of(14, 0.3, random);
  one.designs.resize(1);
  one.responses = one.responses.col(0).eval();
  const Eigen::MatrixXd& X = one.designs.front();
  const Eigen::MatrixXd P =
      Eigen::MatrixXd::Identity(14, 14) - X * (X.transpose() * X).inverse() * X.transpose();
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(14, 14);
  A.diagonal(1).setConstant(0.5);
  A.diagonal(-1).setConstant(0.5);
  const Eigen::MatrixXd Q = P * A * P;
  const Eigen::VectorXd e = P * one.responses.col(0);
  const double d = 10.0;
  const double mean = Q.trace() / d;
  const double variance = 2.0 * (d * (Q * Q).trace() - Q.trace() * Q.trace()) / (d * d * (d + 2.0));
  EXPECT_NEAR(lag_one_score(one), (e.dot(Q * e) / e.squaredNorm() - mean) / std::sqrt(variance),
              1e-10);
}

TEST(LagOneScore, IsOfVarianceOneForWhiteNoise) {
  RandomStream random(4);
  double sum = 0.0;
  double squares = 0.0;
  constexpr int runs = 4000;
  for (int run = 0; run < runs; ++run) {
    const double score = lag_one_score(noise_of(12, 0.0, random));
    sum += score / runs;
    squares += score * score / runs;
  }
  EXPECT_NEAR(sum, 0.0, 0.06);
  EXPECT_NEAR(squares, 1.0, 0.08);
}

// The filter's whitening against the whole covariance matrix, gaps in the order among it.
TEST(MeanUnderCorrelation, HoldsTheTruthAsOftenAsStated) {
  for (const double rho : {0.0, 0.5, 0.9}) {
    RandomStream random(7);
    int held = 0;
    constexpr int runs = 1000;
    for (int run = 0; run < runs; ++run) {
      const CorrelatedMean mean = mean_under_correlation(noise_of(24, rho, random));
      const double t = student_t_factor(0.95, mean.degrees_of_freedom);
      held += std::abs(mean.estimate(0)) <= t * mean.u(0) ? 1 : 0;
    }
    EXPECT_GT(held, 0.90 * runs) << rho;
    EXPECT_LT(held, 0.998 * runs) << rho;
  }
}

TEST(MeanUnderCorrelation, SeesHowCorrelatedReadingsAre) {
  RandomStream random(9);
  EXPECT_LT(mean_under_correlation(noise_of(400, 0.0, random)).correlation, 0.1);
  EXPECT_NEAR(mean_under_correlation(noise_of(400, 0.85, random)).correlation, 0.85, 0.06);
}

}  // namespace
}  // namespace axiscal
