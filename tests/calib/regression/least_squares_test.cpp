// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/least_squares.hpp"

#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

struct Problem {
  Eigen::MatrixXd X;
  Eigen::VectorXd y;
  Eigen::VectorXd weights;
};

Problem random_problem(Eigen::Index n, Eigen::Index p, std::uint64_t seed) {
  RandomStream random(seed);
  Problem problem{
      .X = Eigen::MatrixXd(n, p), .y = Eigen::VectorXd(n), .weights = Eigen::VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    problem.X(i, 0) = 1.0;
    for (Eigen::Index j = 1; j < p; ++j) {
      problem.X(i, j) = random.normal();
    }
    problem.weights(i) = 0.2 + random.uniform();
    problem.y(i) = 3.0 + problem.X.row(i).sum() + 0.1 * random.normal();
  }
  return problem;
}

// NIST StRD, linear regression, data set NoInt1 (https://www.itl.nist.gov/div898/strd/).
TEST(FitLeastSquares, AgreesWithNistNoInt1) {
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(11, 60.0, 70.0);
  const Eigen::VectorXd y = Eigen::VectorXd::LinSpaced(11, 130.0, 140.0);
  const LeastSquaresFit fit = fit_least_squares(x, y);
  // Certified to 15 digits. The tolerance of 1e-13 allows for the rounding of eleven products.
  EXPECT_NEAR(fit.estimate(0), 2.07438016528926, 2e-13);
  EXPECT_NEAR(std::sqrt(fit.covariance(0, 0)), 0.0165289256198347, 2e-15);
  EXPECT_NEAR(fit.residual_sd, 3.56753034006338, 4e-13);
  EXPECT_NEAR(fit.r_squared, 0.999365492298663, 1e-14);
  EXPECT_EQ(fit.degrees_of_freedom, 10.0);
}

// NIST StRD, linear regression, data set Norris.
TEST(FitLeastSquares, AgreesWithNistNorris) {
  const std::vector<std::pair<double, double>> data = {
      {0.1, 0.2},     {338.8, 337.4}, {118.1, 118.2}, {888.0, 884.6}, {9.2, 10.1},
      {228.1, 226.5}, {668.5, 666.3}, {998.5, 996.3}, {449.1, 448.6}, {778.9, 777.0},
      {559.2, 558.2}, {0.3, 0.4},     {0.1, 0.6},     {778.1, 775.5}, {668.8, 666.9},
      {339.3, 338.0}, {448.9, 447.5}, {10.8, 11.6},   {557.7, 556.0}, {228.3, 228.1},
      {998.0, 995.8}, {888.8, 887.6}, {119.6, 120.2}, {0.3, 0.3},     {0.6, 0.3},
      {557.6, 556.8}, {339.3, 339.1}, {888.0, 887.2}, {998.5, 999.0}, {778.9, 779.0},
      {10.2, 11.1},   {117.6, 118.3}, {228.9, 229.2}, {668.4, 669.1}, {449.2, 448.9},
      {0.2, 0.5}};
  Eigen::MatrixXd X(36, 2);
  Eigen::VectorXd y(36);
  for (Eigen::Index i = 0; i < 36; ++i) {
    X(i, 0) = 1.0;
    X(i, 1) = data[static_cast<std::size_t>(i)].second;
    y(i) = data[static_cast<std::size_t>(i)].first;
  }
  const LeastSquaresFit fit = fit_least_squares(X, y);
  // Certified to 15 digits; 13 digits are required.
  EXPECT_NEAR(fit.estimate(0), -0.262323073774029, 0.26e-13);
  EXPECT_NEAR(fit.estimate(1), 1.00211681802045, 1e-13);
  EXPECT_NEAR(std::sqrt(fit.covariance(0, 0)), 0.232818234301152, 0.23e-13);
  EXPECT_NEAR(std::sqrt(fit.covariance(1, 1)), 0.429796848199937e-3, 0.43e-16);
  EXPECT_NEAR(fit.residual_sd, 0.884796396144373, 0.88e-13);
}

// Every statistic agrees with its textbook formula by the normal equations of a well-conditioned
// problem.
TEST(LeastSquaresDesign, AgreesWithTheTextbookOnABenignProblem) {
  const Problem problem = random_problem(15, 4, 21);
  const LeastSquaresDesign design(problem.X, problem.weights);
  const LeastSquaresFit fit = design.fit(problem.y);
  const Eigen::MatrixXd W = problem.weights.asDiagonal();
  const Eigen::MatrixXd C = (problem.X.transpose() * W * problem.X).inverse();
  const Eigen::VectorXd b = C * problem.X.transpose() * W * problem.y;
  const Eigen::VectorXd r = problem.y - problem.X * b;
  const double rss = r.dot(W * r);
  const double s = std::sqrt(rss / 11.0);
  EXPECT_MATRIX_NEAR(fit.estimate, b, 1e-13);
  EXPECT_MATRIX_NEAR(design.estimate(problem.y), b, 1e-13);
  EXPECT_MATRIX_NEAR(fit.residuals, r, 1e-13);
  EXPECT_NEAR(fit.residual_sd, s, 1e-13);
  EXPECT_MATRIX_NEAR(fit.covariance, s * s * C, 1e-15);
  const Eigen::MatrixXd root = problem.weights.cwiseSqrt().asDiagonal();
  const Eigen::VectorXd h = (root * problem.X * C * problem.X.transpose() * root).diagonal();
  EXPECT_MATRIX_NEAR(fit.leverage, h, 1e-13);
  const double mean = problem.weights.dot(problem.y) / problem.weights.sum();
  const double total = (problem.weights.array() * (problem.y.array() - mean).square()).sum();
  EXPECT_NEAR(fit.r_squared, 1.0 - rss / total, 1e-13);
  for (Eigen::Index i = 0; i < 15; ++i) {
    const double e = std::sqrt(problem.weights(i)) * r(i);
    EXPECT_NEAR(fit.cooks_distance(i), e * e * h(i) / (4.0 * s * s * std::pow(1.0 - h(i), 2)),
                1e-12);
  }
}

TEST(FactoredDesign, EstimatesAsWithStatistics) {
  const Problem problem = random_problem(15, 4, 21);
  const FactoredDesign factored(problem.X, problem.weights);
  const LeastSquaresDesign design(problem.X, problem.weights);
  EXPECT_MATRIX_NEAR(factored.estimate(problem.y), design.fit(problem.y).estimate, 1e-14);
  const Eigen::MatrixXd weighted =
      problem.weights.cwiseSqrt().asDiagonal() * problem.X * factored.root_of_covariance();
  EXPECT_MATRIX_NEAR(factored.basis(), weighted, 1e-14);
  EXPECT_MATRIX_NEAR(factored.basis().transpose() * factored.basis(),
                     Eigen::MatrixXd(Eigen::MatrixXd::Identity(4, 4)), 1e-14);
  EXPECT_EQ(factored.condition_number(), design.condition_number());
  EXPECT_EQ(factored.observations(), design.observations());
}

// Definition: the error of the prediction without a reading, divided by its standard error.
TEST(LeastSquaresDesign, StudentisesAsByDeletion) {
  const Problem problem = random_problem(12, 3, 22);
  const LeastSquaresFit fit = fit_least_squares(problem.X, problem.y);
  for (Eigen::Index i = 0; i < 12; ++i) {
    Eigen::VectorXd weights = Eigen::VectorXd::Ones(12);
    weights(i) = 0.0;
    const LeastSquaresDesign without(problem.X, weights);
    EXPECT_EQ(without.observations(), 11);
    const LeastSquaresFit rest = without.fit(problem.y);
    const Eigen::VectorXd x = problem.X.row(i);
    const double error = problem.y(i) - x.dot(rest.estimate);
    const double se = rest.residual_sd * std::sqrt(1.0 + x.dot(without.unscaled_covariance() * x));
    EXPECT_NEAR(fit.studentized(i), error / se, 1e-11);
    EXPECT_NEAR(rest.residuals(i), error, 1e-13);
  }
}

TEST(LeastSquaresDesign, VarianceInflationIsThatOfAuxiliaryRegressions) {
  Problem problem = random_problem(20, 4, 23);
  problem.X.col(3) = problem.X.col(1) + 0.1 * problem.X.col(3);
  const LeastSquaresDesign design(problem.X);
  const Eigen::VectorXd vif =
      variance_inflation(problem.X, Eigen::VectorXd::Ones(20), design.unscaled_covariance());
  EXPECT_TRUE(std::isnan(vif(0)));
  for (Eigen::Index j = 1; j < 4; ++j) {
    Eigen::MatrixXd others(20, 3);
    for (Eigen::Index k = 0, to = 0; k < 4; ++k) {
      if (k != j) {
        others.col(to++) = problem.X.col(k);
      }
    }
    const double r2 = fit_least_squares(others, problem.X.col(j)).r_squared;
    EXPECT_NEAR(vif(j) * (1.0 - r2), 1.0, 1e-9);
  }
}

// Bjorck's refinement does not change well-conditioned solutions, and gains digits of
// ill-conditioned ones.
TEST(LeastSquaresDesign, RefinesIllConditionedProblems) {
  // Powers of integers are exact in doubles, and all coefficients are 1 (NIST's Wampler1).
  Eigen::MatrixXd X(21, 6);
  for (Eigen::Index i = 0; i < 21; ++i) {
    for (Eigen::Index j = 0; j < 6; ++j) {
      X(i, j) = std::pow(static_cast<double>(i), static_cast<double>(j));
    }
  }
  const LeastSquaresDesign design(X);
  EXPECT_GT(design.condition_number(), LeastSquaresDesign::refinement_above);
  const LeastSquaresFit fit = design.fit(X.rowwise().sum());
  EXPECT_MATRIX_NEAR(fit.estimate, Eigen::VectorXd::Ones(6), 1e-15);
  EXPECT_LT(fit.residual_sd, 1e-13);
}

TEST(LeastSquaresDesign, SurvivesExtremeScales) {
  Problem problem = random_problem(10, 3, 24);
  const Eigen::VectorXd plain = fit_least_squares(problem.X, problem.y).estimate;
  problem.X.col(1) *= 1e-150;
  problem.X.col(2) *= 1e150;
  const LeastSquaresFit fit = fit_least_squares(problem.X, problem.y);
  EXPECT_NEAR(fit.estimate(1) * 1e-150, plain(1), 1e-12);
  EXPECT_NEAR(fit.estimate(2) * 1e150, plain(2), 1e-12);
}

TEST(LeastSquaresDesign, HasNoStatisticsWithoutDegreesOfFreedom) {
  const Problem problem = random_problem(4, 4, 25);
  const LeastSquaresFit fit = fit_least_squares(problem.X, problem.y);
  EXPECT_EQ(fit.degrees_of_freedom, 0.0);
  EXPECT_TRUE(std::isnan(fit.residual_sd));
  EXPECT_TRUE(fit.covariance.array().isNaN().all());
  EXPECT_TRUE(fit.studentized.array().isNaN().all());
  EXPECT_TRUE(fit.estimate.allFinite());
}

TEST(LeastSquaresDesign, NamesWhatIsNotDetermined) {
  Problem problem = random_problem(8, 4, 26);
  problem.X.col(3) = 2.0 * problem.X.col(1);
  try {
    const LeastSquaresDesign design(problem.X, Eigen::VectorXd(), {"bias", "a", "b", "c"});
    FAIL() << "accepted";
  } catch (const RankDeficientError& error) {
    EXPECT_THAT(error.undetermined(), testing::ElementsAre("a", "c"));
    EXPECT_STREQ(error.what(), "the design does not determine a, c");
  }
  EXPECT_THAT(undetermined_columns(problem.X), testing::ElementsAre(1, 3));
  EXPECT_THAT(undetermined_columns(problem.X.topRows(2)), testing::SizeIs(testing::Ge(2)));
  EXPECT_THROW(LeastSquaresDesign(Eigen::MatrixXd::Zero(5, 1)), RankDeficientError);
  EXPECT_THROW(LeastSquaresDesign(problem.X.topRows(3)), RankDeficientError);
}

TEST(LeastSquaresDesign, RejectsBadArguments) {
  const Problem problem = random_problem(6, 2, 27);
  Eigen::MatrixXd broken = problem.X;
  broken(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(LeastSquaresDesign{broken}, DomainError);
  EXPECT_THROW(LeastSquaresDesign(problem.X, Eigen::VectorXd::Ones(5)), DomainError);
  EXPECT_THROW(LeastSquaresDesign(problem.X, -problem.weights), DomainError);
  EXPECT_THROW(LeastSquaresDesign(Eigen::MatrixXd(3, 0)), DomainError);
  EXPECT_THROW(static_cast<void>(fit_least_squares(problem.X, problem.y.head(5))), DomainError);
  const Eigen::VectorXd infinite =
      Eigen::VectorXd::Constant(6, std::numeric_limits<double>::infinity());
  EXPECT_THROW(static_cast<void>(fit_least_squares(problem.X, infinite)), DomainError);
}

}  // namespace
}  // namespace axiscal
