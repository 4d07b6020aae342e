// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/serial_correlation.hpp"

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

// Compares with the definition by whole matrices, Q = P A P.
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

// Returns the first coefficient of the first response, by ordinary least squares.
double first_coefficient(const OrderedReadings& readings) {
  const Eigen::MatrixXd& X = readings.designs.front();
  return (X.transpose() * X).inverse().row(0).dot(X.transpose() * readings.responses.col(0));
}

// The intervals cover the truth with the stated probability.
TEST(MeanUnderCorrelation, HoldsTheTruthAsOftenAsStated) {
  for (const double rho : {0.0, 0.5, 0.9}) {
    RandomStream random(7);
    int held = 0;
    constexpr int runs = 1000;
    for (int run = 0; run < runs; ++run) {
      const OrderedReadings readings = noise_of(24, rho, random);
      const CorrelatedMean mean = uncertainty_of_correlated_mean(readings);
      const double t = student_t_factor(0.95, mean.degrees_of_freedom);
      held += std::abs(first_coefficient(readings)) <= t * mean.u(0) ? 1 : 0;
    }
    EXPECT_GT(held, 0.90 * runs) << rho;
    EXPECT_LT(held, 0.998 * runs) << rho;
  }
}

TEST(MeanUnderCorrelation, SeesHowCorrelatedReadingsAre) {
  RandomStream random(9);
  EXPECT_LT(uncertainty_of_correlated_mean(noise_of(400, 0.0, random)).correlation, 0.1);
  EXPECT_NEAR(uncertainty_of_correlated_mean(noise_of(400, 0.85, random)).correlation, 0.85, 0.06);
}

// Generalised least squares with an explicit covariance matrix V.
struct DenseFit {
  Eigen::VectorXd estimate;
  Eigen::MatrixXd covariance;
  double log_likelihood = 0.0;
};

DenseFit dense_fit(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Eigen::MatrixXd& V) {
  const Eigen::MatrixXd W = V.inverse();
  const Eigen::MatrixXd N = X.transpose() * W * X;
  DenseFit fit{.estimate = N.inverse() * (X.transpose() * W * y), .covariance = {}};
  const Eigen::VectorXd left = y - X * fit.estimate;
  const auto free = static_cast<double>(X.rows() - X.cols());
  const double squares = left.dot(W * left);
  fit.covariance = squares / free * N.inverse();
  fit.log_likelihood = -0.5 * std::log(V.determinant()) - 0.5 * std::log(N.determinant()) -
                       0.5 * free * std::log(squares);
  return fit;
}

// The mean over several covariance matrices, weighted by likelihood and prior.
CorrelatedFit dense_mean(const std::vector<DenseFit>& fits, const std::vector<double>& priors) {
  double best = -1e300;
  for (const DenseFit& fit : fits) {
    best = std::max(best, fit.log_likelihood);
  }
  double sum = 0.0;
  CorrelatedFit mean;
  mean.estimate = Eigen::VectorXd::Zero(fits.front().estimate.size());
  mean.covariance = Eigen::MatrixXd::Zero(mean.estimate.size(), mean.estimate.size());
  std::vector<double> weights;
  for (std::size_t g = 0; g < fits.size(); ++g) {
    weights.push_back(priors[g] * std::exp(fits[g].log_likelihood - best));
    sum += weights.back();
  }
  for (std::size_t g = 0; g < fits.size(); ++g) {
    mean.estimate += weights[g] / sum * fits[g].estimate;
  }
  for (std::size_t g = 0; g < fits.size(); ++g) {
    const Eigen::VectorXd off = fits[g].estimate - mean.estimate;
    mean.covariance += weights[g] / sum * (fits[g].covariance + off * off.transpose());
  }
  return mean;
}

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, RandomStream& random) {
  Eigen::MatrixXd all(rows, columns);
  for (double& value : all.reshaped()) {
    value = random.normal();
  }
  return all;
}

// The result does not depend on units and offsets, nor on whether the responses share one design.
const std::vector<double> rhos = {0.0, 0.2, 0.4, 0.6, 0.75, 0.85, 0.92, 0.96, 0.985};

struct DenseFits {
  std::vector<DenseFit> fits;
  std::vector<double> priors;
};

// Fits with V(i, j) = h_i . h_j rho^|i - j| + white I, for each correlation rho and for shares of
// white noise. All rho have the same prior weight.
DenseFits dense_fits(const Eigen::MatrixXd& X,
                     const Eigen::VectorXd& y,
                     const Eigen::MatrixX3d& h,
                     const std::vector<double>& correlations) {
  const Eigen::Index n = X.rows();
  DenseFits models;
  for (const double rho : correlations) {
    for (const double white : {0.0, 0.1, 0.3, 1.0, 3.0, 10.0}) {
      if (rho == 0.0 && white > 0.0) {
        continue;
      }
      Eigen::MatrixXd V = white * Eigen::MatrixXd::Identity(n, n);
      for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j < n; ++j) {
          V(i, j) += h.row(i).dot(h.row(j)) *
                     (i == j ? 1.0 : std::pow(rho, static_cast<double>(std::abs(i - j))));
        }
      }
      models.fits.push_back(dense_fit(X, y, V));
      models.priors.push_back(rho == 0.0 ? 1.0 : 1.0 / 6.0);
    }
  }
  return models;
}

TEST(MeanUnderCorrelation, DoesNotDependOnUnitsAndOffsets) {
  RandomStream random(11);
  OrderedReadings readings = noise_of(24, 0.6, random);
  for (const bool with_blocks : {false, true}) {
    for (int i = 0; i < 24 && with_blocks; ++i) {
      readings.blocks.push_back(i / 8);
    }
    OrderedReadings other = readings;
    other.designs[1].col(2) *= 1e3;
    other.responses.array() += 1e5;
    const CorrelatedMean one = uncertainty_of_correlated_mean(readings);
    const CorrelatedMean two = uncertainty_of_correlated_mean(other);
    EXPECT_NEAR(two.correlation, one.correlation, 1e-9);
    for (Eigen::Index k = 0; k < 3; ++k) {
      EXPECT_NEAR(two.u(k), one.u(k), 1e-9);
    }
  }
}

TEST(MeanUnderCorrelation, IsTheMeanOverWholeCovarianceMatrices) {
  RandomStream random(5);
  constexpr Eigen::Index n = 20;
  OrderedReadings readings = noise_of(n, 0.7, random);
  readings.designs.resize(1);
  readings.responses = readings.responses.col(0).eval();
  const Eigen::MatrixXd& X = readings.designs.front();
  const Eigen::MatrixX3d h = Eigen::RowVector3d::UnitX().replicate(n, 1);
  const DenseFits models = dense_fits(X, readings.responses.col(0), h, rhos);
  const CorrelatedFit all = dense_mean(models.fits, models.priors);
  // u^2 is the mean of u_g^2 + (b_g - b)^2 about the estimate b of least squares.
  const double off = all.estimate(0) - first_coefficient(readings);
  const double expected = std::sqrt(all.covariance(0, 0) + off * off);
  const CorrelatedMean found = uncertainty_of_correlated_mean(readings);
  EXPECT_NEAR(found.u(0), expected, 1e-8 * expected);
  EXPECT_NEAR(found.u_if_white(0), std::sqrt(models.fits.front().covariance(0, 0)),
              1e-8 * expected);
}

TEST(FitUnderCorrelation, IsTheMeanOverWholeCovarianceMatrices) {
  RandomStream random(7);
  constexpr Eigen::Index n = 24;
  const Eigen::MatrixXd X = random_matrix(n, 3, random);
  const Eigen::VectorXd y = random_matrix(n, 1, random);
  const Eigen::MatrixX3d h = random_matrix(n, 3, random);
  std::vector<double> more_rhos = rhos;
  more_rhos.push_back(0.995);
  const DenseFits models = dense_fits(X, y, h, more_rhos);
  const CorrelatedFit expected = dense_mean(models.fits, models.priors);
  const CorrelatedFit found = fit_with_correlated_noise(X, y, h);
  EXPECT_TRUE(found.estimate.isApprox(expected.estimate, 1e-8)) << found.estimate.transpose();
  EXPECT_TRUE(found.covariance.isApprox(expected.covariance, 1e-8));
  EXPECT_EQ(found.degrees_of_freedom, 21.0);
}

// Two residuals for each reading, and a correlated cause along one direction of them.
TEST(FitUnderWander, IsTheMeanOverWholeCovarianceMatrices) {
  RandomStream random(8);
  constexpr Eigen::Index n = 12;
  const Eigen::MatrixXd J = random_matrix(2 * n, 4, random);
  Eigen::VectorXd r = random_matrix(2 * n, 1, random);
  r -= J * (J.transpose() * J).inverse() * (J.transpose() * r);  // projects r off the columns of J
  Eigen::MatrixXd g = random_matrix(n, 2, random);
  const Eigen::VectorXd size = g.rowwise().norm();
  Eigen::MatrixXd along(n, 4);
  Eigen::VectorXd deviations(n);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(2 * n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::RowVector2d unit = g.row(i) / size(i);
    along.row(i) = unit * J.middleRows<2>(2 * i);
    deviations(i) = unit * r.segment<2>(2 * i);
    H.block<2, 1>(2 * i, i) = g.row(i).transpose();
  }
  std::vector<DenseFit> fits = {dense_fit(J, r, Eigen::MatrixXd::Identity(2 * n, 2 * n))};
  std::vector<double> priors = {1.0};
  for (const double rho : {0.0, 0.5, 0.8, 0.92, 0.98}) {
    for (const double lambda : {0.3, 1.0, 3.0, 10.0, 30.0}) {
      Eigen::MatrixXd R(n, n);
      for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j < n; ++j) {
          R(i, j) = i == j ? 1.0 : std::pow(rho, static_cast<double>(std::abs(i - j)));
        }
      }
      fits.push_back(dense_fit(
          J, r, Eigen::MatrixXd::Identity(2 * n, 2 * n) + lambda * H * R * H.transpose()));
      priors.push_back(0.2);
    }
  }
  const CorrelatedFit expected = dense_mean(fits, priors);
  const CorrelatedFit found =
      fit_with_common_ar1({.information = J.transpose() * J,
                           .squares = r.squaredNorm(),
                           .along = along,
                           .deviations = deviations,
                           .sizes = size,
                           .places = Eigen::VectorXd::LinSpaced(n, 0.0, n - 1.0),
                           .degrees_of_freedom = 2.0 * n - 4.0});
  EXPECT_TRUE(found.estimate.isApprox(expected.estimate, 1e-8)) << found.estimate.transpose();
  EXPECT_TRUE(found.covariance.isApprox(expected.covariance, 1e-8));
}

}  // namespace
}  // namespace axiscal
