// SPDX-License-Identifier: Apache-2.0
// Fits under hypotheses, compared with explicit regressions.
#include "calib/mistakes/src/hypothesis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/core/rotation.hpp"
#include "calib/fit/estimation.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

const Eigen::Vector3d hypothesis_scale(1.0, 2.0, 0.5);

ReadingSet hypothesis_set(int points, std::uint64_t seed, double noise_sd = 1e-3) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            standard_design(points), noise_sd, seed);
}

HypothesisFitter known_fitter(const ReadingSet& set) {
  return {set.field, true, hypothesis_scale};
}

HypothesisFitter open_fitter(const ReadingSet& set) {
  return {set.field, false, hypothesis_scale};
}

// Regression of each axis on `readings` by QR with a known field.
struct RegressionByHand {
  RegressionByHand(const ReadingSet& set,
                   const Eigen::Vector3d& in_table,
                   const std::vector<Eigen::Index>& readings) {
    const Eigen::MatrixXd X = test::rows_of(set, in_table)(readings, Eigen::all);
    const Eigen::MatrixXd Y = set.response(readings, Eigen::all);
    coefficients = X.householderQr().solve(Y);
    squares = (Y - X * coefficients).colwise().squaredNorm();
  }

  Eigen::MatrixXd coefficients;  // 4 x m
  Eigen::VectorXd squares;       // m [unit^2]
};

std::vector<Eigen::Index> all_but(const ReadingSet& set, const std::vector<Eigen::Index>& gone) {
  std::vector<Eigen::Index> left;
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    if (std::find(gone.begin(), gone.end(), i) == gone.end()) {
      left.push_back(i);
    }
  }
  return left;
}

Eigen::VectorXd in_scale(const Eigen::VectorXd& squares) {
  return squares.cwiseQuotient(hypothesis_scale.cwiseAbs2());
}

TEST(HypothesisFitter, IsTheRegressionOfEachAxisWhereTheFieldIsKnown) {
  const ReadingSet set = hypothesis_set(24, 1);
  const HypothesisFit fit = known_fitter(set).fit(set);
  ASSERT_TRUE(fit.fitted);
  const RegressionByHand hand(set, test::sloping_gravity, all_but(set, {}));
  EXPECT_MATRIX_NEAR(fit.coefficients, hand.coefficients, 1e-12);
  EXPECT_MATRIX_NEAR(fit.rss, in_scale(hand.squares), 1e-15);
  EXPECT_MATRIX_NEAR(fit.degrees_of_freedom, Eigen::Vector3d::Constant(20.0), 1e-9);
  EXPECT_DOUBLE_EQ(fit.total(), fit.rss.sum());
  EXPECT_NEAR(fit.dof(), 60.0, 1e-9);
  EXPECT_EQ(fit.added.size(), 0);
  const Eigen::MatrixXd left =
      (set.response - test::rows_of(set, test::sloping_gravity) * hand.coefficients) *
      hypothesis_scale.cwiseInverse().asDiagonal();
  EXPECT_MATRIX_NEAR(fit.residuals, left, 1e-12);
}

TEST(HypothesisFitter, LeavesReadingsOutAsIfTheyHadNotBeenTaken) {
  const ReadingSet set = hypothesis_set(12, 2);
  for (const auto& gone : {std::vector<std::size_t>{0}, {4, 7}, {1, 6, 11}}) {
    const HypothesisFit fit = known_fitter(set).fit(set, gone);
    ASSERT_TRUE(fit.fitted);
    const RegressionByHand hand(set, test::sloping_gravity,
                                all_but(set, std::vector<Eigen::Index>(gone.begin(), gone.end())));
    EXPECT_MATRIX_NEAR(fit.coefficients, hand.coefficients, 1e-12);
    EXPECT_MATRIX_NEAR(fit.rss, in_scale(hand.squares), 1e-15);
    EXPECT_NEAR(fit.dof(), 3.0 * (12.0 - static_cast<double>(gone.size()) - 4.0), 1e-9);
  }
}

// Added columns are shared by all axes, for example a drift whose size differs between axes.
TEST(HypothesisFitter, AddsColumnsAsOneRegressionOfAllAxesDoes) {
  const ReadingSet set = hypothesis_set(12, 3);
  const Eigen::Index n = set.size();
  RandomStream random(30);
  Eigen::MatrixXd Z(3 * n, 2);
  for (double& z : Z.reshaped()) {
    z = random.normal();
  }
  const HypothesisFit fit =
      known_fitter(set).fit(set, {}, [&](const auto&, const auto&) { return Z; });
  ASSERT_TRUE(fit.fitted);
  // The rows of the axes follow each other, divided by the scale of the axis.
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(3 * n, 14);
  Eigen::VectorXd y(3 * n);
  for (Eigen::Index k = 0; k < 3; ++k) {
    A.block(n * k, 4 * k, n, 4) = X / hypothesis_scale(k);
    A.block(n * k, 12, n, 2) = Z.middleRows(n * k, n) / hypothesis_scale(k);
    y.segment(n * k, n) = set.response.col(k) / hypothesis_scale(k);
  }
  const Eigen::VectorXd b = A.householderQr().solve(y);
  const Eigen::MatrixXd covariance = (A.transpose() * A).inverse();
  EXPECT_MATRIX_NEAR(fit.coefficients, b.head(12).reshaped(4, 3), 1e-11);
  EXPECT_MATRIX_NEAR(fit.added, b.tail(2), 1e-11);
  EXPECT_MATRIX_NEAR(fit.information, covariance.diagonal().tail(2).cwiseInverse(), 1e-9);
  EXPECT_NEAR(fit.total(), (y - A * b).squaredNorm(), 1e-14);
  EXPECT_NEAR(fit.dof(), static_cast<double>(3 * n - 14), 1e-9);
}

TEST(HypothesisFitter, TakesAColumnForOneReadingAsItsDeletion) {
  const ReadingSet set = hypothesis_set(12, 4);
  const Eigen::Index n = set.size();
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(3 * n, 3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    Z(n * k + 5, k) = 1.0;
  }
  for (const HypothesisFitter& fitter : {known_fitter(set), open_fitter(set)}) {
    const HypothesisFit without = fitter.fit(set, {5});
    const HypothesisFit any = fitter.fit(set, {}, [&](const auto&, const auto&) { return Z; });
    ASSERT_TRUE(without.fitted && any.fitted);
    EXPECT_MATRIX_NEAR(any.coefficients, without.coefficients, 1e-9);
    EXPECT_MATRIX_NEAR(any.field.vector(0), without.field.vector(0), 1e-9);
    EXPECT_MATRIX_NEAR(any.rss, without.rss, 1e-11);
    EXPECT_MATRIX_NEAR(any.degrees_of_freedom, without.degrees_of_freedom, 1e-6);
    const Eigen::VectorXd expected =
        (test::rows_of(set, without.field.vector(0)) * without.coefficients).row(5);
    EXPECT_MATRIX_NEAR(any.added, Eigen::VectorXd(set.response.row(5)) - expected, 1e-9);
  }
}

// Sum of squares with the best coefficients for a direction of the field.
double squares_with(const ReadingSet& set, const Eigen::Vector3d& in_table) {
  return in_scale(RegressionByHand(set, in_table, all_but(set, {})).squares).sum();
}

TEST(HypothesisFitter, FindsTheDirectionThatFitsBest) {
  const ReadingSet set = hypothesis_set(12, 5);
  const HypothesisFit fit = open_fitter(set).fit(set);
  ASSERT_TRUE(fit.fitted);
  const Eigen::Vector3d best = fit.field.vector(0);
  EXPECT_NEAR(best.norm(), test::sloping_gravity.norm(), 1e-12);
  EXPECT_NEAR(fit.total(), squares_with(set, best), 1e-14);
  for (const double angle : {1e-4, 1e-3, 1e-2}) {
    for (const Eigen::Vector3d& turn : directions_on_sphere(12)) {
      const Eigen::Vector3d other = rotation_by(angle * turn) * best;
      EXPECT_GE(squares_with(set, other), fit.total() * (1.0 - 1e-9)) << angle;
    }
  }
  EXPECT_NEAR(fit.dof(), 3.0 * 12.0 - 12.0 - 2.0, 1e-9);
}

TEST(HypothesisFitter, ForgetsWhereItStarted) {
  const ReadingSet set = hypothesis_set(12, 6);
  HypothesisFitter fitter = open_fitter(set);
  const HypothesisFit near = fitter.fit(set);
  fitter.start_at(test::gravity_in_table(rotation_by(Eigen::Vector3d(0.03, -0.04, 0.0)) *
                                         test::sloping_gravity));
  const HypothesisFit far = fitter.fit(set);
  ASSERT_TRUE(near.fitted && far.fitted);
  EXPECT_MATRIX_NEAR(far.field.vector(0), near.field.vector(0), 1e-8);
  EXPECT_MATRIX_NEAR(far.coefficients, near.coefficients, 1e-7);
  EXPECT_NEAR(far.total(), near.total(), 1e-9 * near.total());
}

TEST(HypothesisFitter, KeepsAGivenField) {
  const ReadingSet set = hypothesis_set(12, 7);
  HypothesisFitter fitter = known_fitter(set);
  const Eigen::Vector3d wrong(0.05, 0.0, 1.0);
  fitter.start_at(test::gravity_in_table(wrong));
  const HypothesisFit fit = fitter.fit(set);
  ASSERT_TRUE(fit.fitted);
  EXPECT_MATRIX_NEAR(fit.field.vector(0), wrong, 0.0);
  EXPECT_NEAR(fit.total(), squares_with(set, wrong), 1e-12);
  EXPECT_GT(fit.total(), 10.0 * known_fitter(set).fit(set).total());
}

TEST(HypothesisFitter, DoesNotFitWhatReadingsDoNotDetermine) {
  const ReadingSet set = hypothesis_set(12, 8);
  // Three readings do not determine four coefficients, nor do readings on a rest face and its
  // opposite.
  const HypothesisFit few = known_fitter(set).fit(set, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  EXPECT_FALSE(few.fitted);
  EXPECT_EQ(few.fit, nullptr);
  EXPECT_FALSE(known_fitter(set).fit(set, {4, 5, 6, 7, 8, 9, 10, 11}).fitted);
  // A constant column of an axis equals its bias, so the fit is singular.
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(36, 1);
  Z.topRows(12).setOnes();
  EXPECT_FALSE(known_fitter(set).fit(set, {}, [&](const auto&, const auto&) { return Z; }).fitted);
}

TEST(HypothesisFitter, DoesNotDependOnTheOrderOfTheReadings) {
  const ReadingSet set = hypothesis_set(12, 9);
  std::vector<Eigen::Index> order(12);
  std::iota(order.begin(), order.end(), 0);
  RandomStream(90).shuffle(std::span(order));
  ReadingSet other = set;
  other.rotation_sensor_from_table.clear();
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto from = static_cast<std::size_t>(order[i]);
    other.readings[i] = set.readings[from];
    other.rotation_sensor_from_table.push_back(set.rotation_sensor_from_table[from]);
  }
  other.response = set.response(order, Eigen::all).eval();
  const HypothesisFit fit = open_fitter(set).fit(set);
  const HypothesisFit again = open_fitter(other).fit(other);
  EXPECT_MATRIX_NEAR(again.coefficients, fit.coefficients, 1e-9);
  EXPECT_MATRIX_NEAR(again.rss, fit.rss, 1e-12);
  EXPECT_MATRIX_NEAR(again.residuals, fit.residuals(order, Eigen::all), 1e-9);
}

TEST(HypothesisFitter, FollowsTheUnitOfAnAxisAndItsScale) {
  const ReadingSet set = hypothesis_set(12, 10);
  ReadingSet other = set;
  other.response.col(1) *= 1000.0;
  const HypothesisFit fit = open_fitter(set).fit(set);
  const Eigen::Vector3d scale = hypothesis_scale.cwiseProduct(Eigen::Vector3d(1.0, 1000.0, 1.0));
  const HypothesisFit again = HypothesisFitter(set.field, false, scale).fit(other);
  EXPECT_MATRIX_NEAR(again.rss, fit.rss, 1e-12);
  EXPECT_MATRIX_NEAR(again.coefficients.col(1), 1000.0 * fit.coefficients.col(1), 1e-6);
  EXPECT_MATRIX_NEAR(again.field.vector(0), fit.field.vector(0), 1e-9);
}

// If table and cube are rotated together, the instrument's coefficients do not change.
TEST(HypothesisFitter, DoesNotDependOnTheFrameOfTheTable) {
  const ReadingSet set = hypothesis_set(12, 11);
  const Eigen::Matrix3d turn = rotation_by(Eigen::Vector3d(0.4, -0.7, 1.1));
  ReadingSet other = set;
  other.field = test::gravity_in_table(turn * test::sloping_gravity);
  for (std::size_t i = 0; i < other.readings.size(); ++i) {
    other.rotation_sensor_from_table.put(i, set.rotation_sensor_from_table[i] * turn.transpose());
  }
  const HypothesisFit fit = open_fitter(set).fit(set);
  const HypothesisFit again = open_fitter(other).fit(other);
  ASSERT_TRUE(fit.fitted && again.fitted);
  EXPECT_MATRIX_NEAR(again.coefficients, fit.coefficients, 1e-8);
  EXPECT_MATRIX_NEAR(again.field.vector(0), turn * fit.field.vector(0), 1e-8);
  EXPECT_NEAR(again.total(), fit.total(), 1e-9 * fit.total());
}

TEST(HypothesisFitter, CountsAWeightOfTwoAsTwoReadings) {
  ReadingSet weighted = hypothesis_set(12, 12);
  weighted.weights.row(3).setConstant(2.0);
  ReadingSet twice = hypothesis_set(12, 12);
  twice.readings.push_back(twice.readings[3]);
  twice.rotation_sensor_from_table.push_back(Eigen::Matrix3d(twice.rotation_sensor_from_table[3]));
  twice.response.conservativeResize(13, Eigen::NoChange);
  twice.response.row(12) = twice.response.row(3);
  twice.weights = Eigen::MatrixXd::Ones(13, 3);
  const HypothesisFit one = open_fitter(weighted).fit(weighted);
  const HypothesisFit two = open_fitter(twice).fit(twice);
  EXPECT_MATRIX_NEAR(one.coefficients, two.coefficients, 1e-9);
  EXPECT_MATRIX_NEAR(one.rss, two.rss, 1e-12);
  EXPECT_NEAR(one.dof(), two.dof() - 3.0, 1e-9);
}

TEST(HypothesisFitter, ScalesEachAxisByItsScatter) {
  const ReadingSet set = hypothesis_set(24, 13);
  const HypothesisFitter fitter = known_fitter(set);
  const HypothesisFit fit = fitter.fit(set);
  const HypothesisFitter own = fitter.by_scatter_of(fit);
  EXPECT_TRUE(own.known_field());
  const RegressionByHand hand(set, test::sloping_gravity, all_but(set, {}));
  EXPECT_MATRIX_NEAR(own.scale(), (hand.squares / 20.0).cwiseSqrt(), 1e-14);
  // In units of the scatter the sum of squares of an axis equals its degrees of freedom.
  const HypothesisFit again = own.fit(set);
  EXPECT_MATRIX_NEAR(again.rss, again.degrees_of_freedom, 1e-9);
  EXPECT_FALSE(open_fitter(set).by_scatter_of(fit).known_field());
}

TEST(HypothesisFitter, LeavesRoundingOfReadingsWithoutNoise) {
  const ReadingSet set = hypothesis_set(12, 14, 0.0);
  const HypothesisFit fit = open_fitter(set).fit(set);
  ASSERT_TRUE(fit.fitted);
  const Eigen::VectorXd largest = set.response.cwiseAbs().colwise().maxCoeff();
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_GT(fit.rss(k), 0.0);  // so that a likelihood is finite
    EXPECT_LT(std::sqrt(fit.rss(k)) * hypothesis_scale(k), 1e-12 * largest(k));
  }
  EXPECT_MATRIX_NEAR(fit.coefficients.row(0).transpose(), test::some_response().bias, 1e-12);
  EXPECT_MATRIX_NEAR(fit.coefficients.bottomRows(3).transpose(), test::some_response().sensitivity,
                     1e-12);
}

TEST(HypothesisFit, ForgetsItsReadingsOnly) {
  const ReadingSet set = hypothesis_set(12, 15);
  HypothesisFit fit = open_fitter(set).fit(set);
  ASSERT_NE(fit.fit, nullptr);
  const HypothesisFit before = fit;
  fit.forget_readings();
  EXPECT_EQ(fit.fit, nullptr);
  EXPECT_EQ(fit.residuals.size(), 0);
  EXPECT_TRUE(fit.fitted);
  EXPECT_EQ(fit.total(), before.total());
  EXPECT_EQ(fit.coefficients, before.coefficients);
}

// With a fitted direction the model is nearly linear, so the sum of squares has the mean and the
// variance of chi-squared.
TEST(HypothesisFit, HasAsManyDegreesOfFreedomAsItsSumOfSquaresSays) {
  constexpr int runs = 400;
  constexpr double noise = 1e-3;
  double sum = 0.0;
  double squares = 0.0;
  double dof = 0.0;
  for (int t = 0; t < runs; ++t) {
    const ReadingSet set = hypothesis_set(12, 1000 + static_cast<std::uint64_t>(t), noise);
    const HypothesisFit fit =
        HypothesisFitter(set.field, false, Eigen::Vector3d::Constant(noise)).fit(set, {2});
    ASSERT_TRUE(fit.fitted);
    dof = fit.dof();
    sum += fit.total();
    squares += fit.total() * fit.total();
  }
  EXPECT_NEAR(dof, 3.0 * 11.0 - 12.0 - 2.0, 1e-9);
  const double mean = sum / runs;
  const double variance = squares / runs - mean * mean;
  EXPECT_NEAR(mean, dof, 4.0 * std::sqrt(2.0 * dof / runs));
  EXPECT_NEAR(variance, 2.0 * dof, 0.4 * 2.0 * dof);
}

}  // namespace
}  // namespace axiscal
