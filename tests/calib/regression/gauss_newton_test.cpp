// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/gauss_newton.hpp"

#include <array>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "calib/regression/factor.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// NIST StRD, nonlinear regression, Misra1a: y = b1 (1 - exp(-b2 x)), 14 observations.
// https://www.itl.nist.gov/div898/strd/nls/data/misra1a.shtml
struct Misra1a {
  using State = Eigen::Vector2d;
  using Linear = Linearised;

  static constexpr std::array<double, 14> y = {10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02,
                                               44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78};
  static constexpr std::array<double, 14> x = {77.6,  114.9, 141.1, 190.8, 239.9, 289.0, 332.8,
                                               378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0};

  static void linearise(const State& at, Linear& linear) {
    linear.residuals.resize(14);
    linear.jacobian.resize(14, 2);
    for (Eigen::Index i = 0; i < 14; ++i) {
      const double xi = x[static_cast<std::size_t>(i)];
      const double rest = std::exp(-at(1) * xi);
      linear.residuals(i) = at(0) * (1.0 - rest) - y[static_cast<std::size_t>(i)];
      linear.jacobian.row(i) << 1.0 - rest, at(0) * xi * rest;
    }
  }
  static State moved(const State& at, const Eigen::VectorXd& step) { return at + step; }
  static double cost(const State& at, const Linear& /*before*/) {
    Linear linear;
    linearise(at, linear);
    return linear.residuals.squaredNorm();
  }
  static double length(const State& at, const Eigen::VectorXd& step, const Linear& /*there*/) {
    return step.cwiseQuotient(at).norm();
  }
};

TEST(GaussNewton, ReachesTheCertifiedValuesOfMisra1a) {
  const Eigen::Vector2d certified(2.3894212918e+02, 5.5015643181e-04);
  for (const Eigen::Vector2d& start :
       {Eigen::Vector2d(500.0, 1e-4), Eigen::Vector2d(250.0, 5e-4)}) {
    const auto found = gauss_newton(Misra1a{}, start);
    EXPECT_TRUE(found.converged);
    EXPECT_NEAR(found.state(0) / certified(0), 1.0, 2e-10);
    EXPECT_NEAR(found.state(1) / certified(1), 1.0, 2e-10);
    Linearised there;
    Misra1a::linearise(found.state, there);
    const double sd = std::sqrt(there.residuals.squaredNorm() / 12.0);
    EXPECT_NEAR(sd / 1.0187876330e-01, 1.0, 1e-9);
    const Eigen::VectorXd se = sd * Factor(there.jacobian).covariance().diagonal().cwiseSqrt();
    EXPECT_NEAR(se(0) / 2.7070075241e+00, 1.0, 1e-8);
    EXPECT_NEAR(se(1) / 7.2668688436e-06, 1.0, 1e-8);
  }
}

// A curved valley (Rosenbrock). Steps may not take the second unknown below `wall`.
struct Valley {
  using State = Eigen::Vector2d;
  using Linear = Linearised;
  double wall = -std::numeric_limits<double>::infinity();

  static void linearise(const State& at, Linear& linear) {
    linear.residuals = Eigen::Vector2d(10.0 * (at(1) - at(0) * at(0)), 1.0 - at(0));
    linear.jacobian.resize(2, 2);
    linear.jacobian << -20.0 * at(0), 10.0, -1.0, 0.0;
  }
  static State moved(const State& at, const Eigen::Vector2d& step) { return at + step; }
  double cost(const State& at, const Linear& /*before*/) const {
    Linear linear;
    linearise(at, linear);
    return at(1) < wall ? std::numeric_limits<double>::quiet_NaN() : linear.residuals.squaredNorm();
  }
  static double length(const State& /*at*/, const Eigen::Vector2d& step, const Linear& /*there*/) {
    return step.norm();
  }
};

TEST(GaussNewton, DampsStepsThatMakeItWorse) {
  const auto found = gauss_newton(Valley{}, {-1.2, 1.0});
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR((found.state - Eigen::Vector2d::Ones()).norm(), 0.0, 1e-12);
}

// r = e^x - 1. Far from the solution a step reduces the sum of squares much less than the linear
// model predicts. The prediction for the damped step is used.
struct Exponential {
  using State = double;
  using Linear = Linearised;

  static void linearise(double x, Linear& linear) {
    linear.residuals = Eigen::VectorXd::Constant(1, std::expm1(x));
    linear.jacobian = Eigen::MatrixXd::Constant(1, 1, std::exp(x));
  }
  static double moved(double x, const Eigen::VectorXd& step) { return x + step(0); }
  static double cost(double x, const Linear& /*before*/) { return std::expm1(x) * std::expm1(x); }
  static double length(double /*x*/, const Eigen::VectorXd& step, const Linear& /*there*/) {
    return step.norm();
  }
};

TEST(GaussNewton, TriesShorterStepsAsLongAsTheyPromiseSomething) {
  for (const double start : {-5.0, -10.0, -14.0, -16.0}) {
    const auto found = gauss_newton(Exponential{}, start);
    EXPECT_TRUE(found.converged) << start;
    EXPECT_NEAR(found.state, 0.0, 1e-12) << start;
  }
}

TEST(GaussNewton, StaysWhereACostIsANumber) {
  const auto found = gauss_newton(Valley{.wall = 0.5}, {-1.2, 1.0});
  EXPECT_GE(found.state(1), 0.5);
  const auto stopped = gauss_newton(Valley{}, {-1.2, 1.0}, {.most_rounds = 1});
  EXPECT_FALSE(stopped.converged);
  EXPECT_EQ(stopped.rounds, 1);
}

TEST(DampedStep, OfAnOpenProblemIsTheShortest) {
  Linearised open;
  open.residuals = Eigen::Vector3d(1.0, 2.0, 3.0);
  open.jacobian = Eigen::MatrixXd(3, 2);
  open.jacobian << 1.0, 1.0, 2.0, 2.0, 3.0, 3.0;
  for (const bool by_qr : {false, true}) {
    const Eigen::VectorXd step = damped_step(open, 0.0, by_qr);
    EXPECT_NEAR(step(0), -0.5, 1e-12);
    EXPECT_NEAR(step(1), -0.5, 1e-12);
  }
}

// By J^T J half of the digits would be lost if the columns are nearly equal.
TEST(DampedStep, HasAllDigitsWhereTheyAreAskedFor) {
  const Eigen::Vector2d exact(-3.0, 2.0);
  for (const double apart : {1.0, 1e-4}) {
    Linearised linear;
    linear.jacobian = Eigen::MatrixXd::Ones(40, 2);
    linear.jacobian.col(1) += apart * Eigen::VectorXd::LinSpaced(40, -1.0, 1.0);
    linear.residuals = -linear.jacobian * exact;
    EXPECT_LT((damped_step(linear, 0.0, true) - exact).norm(), 1e-10) << apart;
  }
}

TEST(Factor, GivesWhatTheNormalEquationsGive) {
  Eigen::MatrixXd J(5, 3);
  J << 1, 2e3, 1e-4, 1, -1e3, 3e-4, 1, 5e2, -2e-4, 1, 0, 5e-4, 1, 3e3, 1e-4;
  const Eigen::VectorXd r = Eigen::VectorXd::LinSpaced(5, 1.0, 9.0);
  const Factor qr(J);
  ASSERT_TRUE(qr.has_full_rank());
  const Eigen::VectorXd lengths = J.colwise().norm();
  const Eigen::MatrixXd N = J.transpose() * J;
  EXPECT_LT((lengths.cwiseInverse().asDiagonal() *
             (N * qr.covariance() - Eigen::MatrixXd::Identity(3, 3)) * lengths.asDiagonal())
                .norm(),
            1e-12);
  EXPECT_LT((J.transpose() * (J * qr.solve(r) - r)).cwiseQuotient(lengths).norm(), 1e-12);
  const Eigen::MatrixXd Q = J * qr.root_of_covariance();
  EXPECT_LT((Q.transpose() * Q - Eigen::MatrixXd::Identity(3, 3)).norm(), 1e-12);
  EXPECT_LT((qr.leverage() - Q.rowwise().squaredNorm()).norm(), 1e-12);
  J.col(2) = 2.0 * J.col(0);
  EXPECT_FALSE(Factor(J).has_full_rank());
  EXPECT_EQ(confounded_columns(J, 1e-9, 1e-3), (std::vector<Eigen::Index>{0, 2}));
}

TEST(Factor, NamesNeighboursOnce) {
  EXPECT_EQ(undetermined_column_names({0, 1, 3}, {"direction", "direction", "x", "y"}),
            (std::vector<std::string>{"direction", "y"}));
}

}  // namespace
}  // namespace axiscal
