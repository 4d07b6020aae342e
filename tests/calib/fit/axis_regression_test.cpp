// SPDX-License-Identifier: Apache-2.0
// The regression of each axis and its statistics, compared with textbooks and the normal equations.
#include "calib/fit/src/axis_regression.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

RegressionRows rows_in(std::vector<int> group) {
  return {.rows = {}, .group = std::move(group), .laying = {}};
}

// Readings of one laying have the weight of their mean, so F is that of the weighted means.
TEST(LackOfFitOfLayings, IsThatOfTheirMeans) {
  const RegressionRows rows{.rows = {},
                            .group = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2},
                            .laying = {0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5}};
  Eigen::VectorXd residuals(12);
  residuals << 0.3, -0.5, 0.7, 0.1, -0.4, 0.2, -0.6, -0.1, 0.5, 0.4, -0.2, -0.3;
  Eigen::VectorXd means(6);
  for (Eigen::Index i = 0; i < 6; ++i) {
    means(i) = std::sqrt(2.0) * residuals.segment<2>(2 * i).mean();
  }
  const LackOfFit test = test_lack_of_fit(rows, Eigen::VectorXd::Ones(12), residuals, 10.0, 0.0, 0);
  const LackOfFit of_means = test_lack_of_fit(
      rows_in({0, 0, 1, 1, 2, 2}), Eigen::VectorXd::Constant(6, 2.0), means, 4.0, 0.0, 0);
  EXPECT_EQ(test.pure_error_dof, 3.0);
  EXPECT_EQ(test.lack_of_fit_dof, of_means.lack_of_fit_dof);
  EXPECT_NEAR(test.f, of_means.f, 1e-12);
  EXPECT_NEAR(test.pure_error_sd, of_means.pure_error_sd, 1e-12);
}

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double regressed_noise = 1e-3;

ReadingSet set_to_regress(std::uint64_t seed, int points = 24) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            standard_design(points), regressed_noise, seed);
}

// Regression of all axes. The weights are those of the first axis.
std::vector<AxisRegression> regressions_of_set(const ReadingSet& set, const Eigen::MatrixXd& X) {
  const Eigen::VectorXd w = set.weights.col(0);
  const FactoredDesign factored(X, w);
  return regress({.set = set,
                  .first = 0,
                  .factored = factored,
                  .design = X,
                  .weights = w,
                  .responses = set.response,
                  .names = [&](Eigen::Index k) { return set.names_of_axis(k); }});
}

Eigen::VectorXd unequal_weights(Eigen::Index n) {
  Eigen::VectorXd w(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    w(i) = 0.4 + 0.3 * static_cast<double>(i % 5);
  }
  return w;
}

TEST(RSquaredAboutMean, IsOneLessTheShareOfTheResiduals) {
  const Eigen::VectorXd y = Eigen::VectorXd::LinSpaced(7, -1.0, 3.0).array().cube();
  const Eigen::VectorXd w = unequal_weights(7);
  EXPECT_EQ(r_squared_about_mean(y, w, Eigen::VectorXd::Zero(7)), 1.0);
  const double mean = (w.array() * y.array()).sum() / w.sum();
  const Eigen::VectorXd about_mean = w.cwiseSqrt().cwiseProduct((y.array() - mean).matrix());
  EXPECT_NEAR(r_squared_about_mean(y, w, about_mean), 0.0, 1e-14);
  EXPECT_NEAR(r_squared_about_mean(y, w, 0.5 * about_mean), 0.75, 1e-14);
  // R^2 does not depend on the unit or the zero point of the readings.
  EXPECT_NEAR(r_squared_about_mean((3.0 * y.array() + 5.0).matrix(), w, 1.5 * about_mean), 0.75,
              1e-12);
}

TEST(Regress, AgreesWithTheNormalEquations) {
  ReadingSet set = set_to_regress(1);
  const Eigen::VectorXd w = unequal_weights(set.size());
  set.weights = w.replicate(1, 3);
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  const std::vector<AxisRegression> axes = regressions_of_set(set, X);
  ASSERT_EQ(axes.size(), 3U);
  const Eigen::MatrixXd C = (X.transpose() * w.asDiagonal() * X).inverse();
  const Eigen::MatrixXd B = C * (X.transpose() * w.asDiagonal() * set.response);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const LeastSquaresFit& fit = axes[static_cast<std::size_t>(k)].fit;
    EXPECT_MATRIX_NEAR(fit.estimate, B.col(k), 1e-12);
    const Eigen::VectorXd left = set.response.col(k) - X * B.col(k);
    const double s2 = w.dot(left.cwiseAbs2()) / 20.0;
    EXPECT_NEAR(fit.residual_sd, std::sqrt(s2), 1e-12);
    EXPECT_EQ(fit.degrees_of_freedom, 20.0);
    EXPECT_MATRIX_NEAR(fit.covariance, s2 * C, 1e-12 * s2);
    EXPECT_EQ(axes[static_cast<std::size_t>(k)].robust_weights.size(), 0);
  }
}

// Belsley, Kuh & Welsch: the inflation is 1 / (1 - R_j^2), with R_j^2 of the regression of column j
// on all other columns.
TEST(Regress, InflatesVariancesAsTheOtherColumnsExplainAColumn) {
  ReadingSet set = set_to_regress(2);
  const Eigen::VectorXd w = unequal_weights(set.size());
  set.weights = w.replicate(1, 3);
  Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  X.col(3) += 0.8 * X.col(1);
  const AxisRegression axis = regressions_of_set(set, X).front();
  for (const Eigen::Index j : {1, 2, 3}) {
    const std::vector<Eigen::Index> others = j == 1   ? std::vector<Eigen::Index>{0, 2, 3}
                                             : j == 2 ? std::vector<Eigen::Index>{0, 1, 3}
                                                      : std::vector<Eigen::Index>{0, 1, 2};
    const Eigen::MatrixXd A = w.cwiseSqrt().asDiagonal() * X(Eigen::all, others);
    const Eigen::VectorXd x = w.cwiseSqrt().cwiseProduct(X.col(j));
    const Eigen::VectorXd left = x - A * A.householderQr().solve(x);
    EXPECT_NEAR(axis.variance_inflation(j), 1.0 / (1.0 - r_squared_about_mean(X.col(j), w, left)),
                1e-9);
  }
  EXPECT_GT(axis.variance_inflation(1), 1.5);
  Eigen::MatrixXd unit = w.cwiseSqrt().asDiagonal() * X;
  unit.colwise().normalize();
  const Eigen::VectorXd singular = unit.jacobiSvd().singularValues();
  EXPECT_NEAR(axis.condition_number, singular(0) / singular(3), 1e-9);
}

TEST(Regress, GivesAWrongReadingNoRobustWeight) {
  ReadingSet set = set_to_regress(3);
  set.response(5, 1) += 1.0;
  set.robust = true;
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  const std::vector<AxisRegression> axes = regressions_of_set(set, X);
  EXPECT_EQ(axes[1].robust_weights(5), 0.0);
  EXPECT_GT(axes[0].robust_weights(5), 0.0);
  Eigen::VectorXd w = Eigen::VectorXd::Ones(set.size());
  w(5) = 0.0;
  const Eigen::VectorXd without = (X.transpose() * w.asDiagonal() * X)
                                      .ldlt()
                                      .solve(X.transpose() * w.cwiseProduct(set.response.col(1)));
  EXPECT_MATRIX_NEAR(axes[1].fit.estimate, without, 0.5 * regressed_noise);
  EXPECT_NEAR(axes[1].fit.residual_sd / regressed_noise, 1.0, 0.5);
  // The wrong reading has weight 0 and a large studentised residual.
  EXPECT_GT(std::abs(axes[1].fit.studentized(5)), 100.0);
}

TEST(RequireRobustFreedom, NamesTheDegreesOfFreedomThatLack) {
  EXPECT_NO_THROW(require_robust_freedom(6.0));
  EXPECT_THAT([] { require_robust_freedom(2.0); },
              testing::ThrowsMessage<RefusedError>(
                  testing::AllOf(HasSubstr("with 2 degrees of freedom"), HasSubstr("joint"))));
}

// A textbook example: three fertilisers on six plots each, F(2, 15) = 9.26, p = 0.0024.
TEST(PureErrorTest, AgreesWithTheOneWayAnova) {
  Eigen::VectorXd y(18);
  y << 6, 8, 4, 5, 3, 4, 8, 12, 9, 11, 6, 8, 13, 9, 11, 8, 7, 12;
  std::vector<int> group;
  for (int i = 0; i < 18; ++i) {
    group.push_back(i / 6);
  }
  const LackOfFit test = test_lack_of_fit(rows_in(group), Eigen::VectorXd::Ones(18),
                                          (y.array() - y.mean()).matrix(), 17.0, 0.0, 0);
  EXPECT_EQ(test.pure_error_dof, 15.0);
  EXPECT_EQ(test.lack_of_fit_dof, 2.0);
  EXPECT_NEAR(test.pure_error_sd, std::sqrt(68.0 / 15.0), 1e-12);
  EXPECT_NEAR(test.f, (84.0 / 2.0) / (68.0 / 15.0), 1e-12);
  EXPECT_NEAR(test.p_value, 0.0024, 5e-5);
}

// Weighted readings with three repeats at each of five places, and the residuals of a straight
// line.
class LineWithRepeats : public testing::Test {
 protected:
  LineWithRepeats() {
    RandomStream random(4);
    for (Eigen::Index i = 0; i < 15; ++i) {
      group_.push_back(static_cast<int>(i % 5));
      X_.row(i) << 1.0, static_cast<double>(i % 5);
      y_(i) = 2.0 + 0.5 * X_(i, 1) + 0.1 * X_(i, 1) * X_(i, 1) + 0.2 * random.normal();
    }
  }

  [[nodiscard]] Eigen::VectorXd residuals() const {
    const Eigen::VectorXd b =
        (X_.transpose() * w_.asDiagonal() * X_).ldlt().solve(X_.transpose() * w_.cwiseProduct(y_));
    return w_.cwiseSqrt().cwiseProduct(y_ - X_ * b);
  }

  std::vector<int> group_;
  Eigen::MatrixXd X_ = Eigen::MatrixXd(15, 2);
  Eigen::VectorXd y_ = Eigen::VectorXd(15);
  Eigen::VectorXd w_ = unequal_weights(15) + 0.01 * Eigen::VectorXd::LinSpaced(15, 0.0, 14.0);
};

// The pure error is the scatter about a separate value at each place, here by a regression on
// indicators.
TEST_F(LineWithRepeats, ComparesTheLineWithAFreeValueOfEachPlace) {
  Eigen::MatrixXd free = Eigen::MatrixXd::Zero(15, 5);
  for (Eigen::Index i = 0; i < 15; ++i) {
    free(i, i % 5) = std::sqrt(w_(i));
  }
  const Eigen::VectorXd root = w_.cwiseSqrt().cwiseProduct(y_);
  const double pure = (root - free * free.householderQr().solve(root)).squaredNorm();
  const double all = residuals().squaredNorm();
  const LackOfFit test = test_lack_of_fit(rows_in(group_), w_, residuals(), 13.0, 0.0, 0);
  EXPECT_EQ(test.pure_error_dof, 10.0);
  EXPECT_EQ(test.lack_of_fit_dof, 3.0);
  EXPECT_NEAR(test.pure_error_sd, std::sqrt(pure / 10.0), 1e-12);
  EXPECT_NEAR(test.f, ((all - pure) / 3.0) / (pure / 10.0), 1e-9);
  EXPECT_NEAR(test.p_value, f_upper_p(test.f, 3.0, 10.0), 1e-12);
}

TEST_F(LineWithRepeats, DoesNotKnowTheUnit) {
  const LackOfFit one = test_lack_of_fit(rows_in(group_), w_, residuals(), 13.0, 0.0, 0);
  const LackOfFit other = test_lack_of_fit(rows_in(group_), w_, 1e3 * residuals(), 13.0, 0.0, 0);
  EXPECT_NEAR(other.pure_error_sd, 1e3 * one.pure_error_sd, 1e-9);
  EXPECT_NEAR(other.f, one.f, 1e-9);
  EXPECT_NEAR(other.p_value, one.p_value, 1e-12);
}

// Effects of the run differ between repeats, so they reduce the degrees of freedom of the pure
// error.
TEST_F(LineWithRepeats, TakesEffectsOfTheRunFromThePureError) {
  const LackOfFit plain = test_lack_of_fit(rows_in(group_), w_, residuals(), 13.0, 0.0, 0);
  const LackOfFit with = test_lack_of_fit(rows_in(group_), w_, residuals(), 11.0, 0.0, 2);
  EXPECT_EQ(with.pure_error_dof, 8.0);
  EXPECT_EQ(with.lack_of_fit_dof, 3.0);
  EXPECT_NEAR(with.f / plain.f, 8.0 / 10.0, 1e-12);
}

TEST_F(LineWithRepeats, LeavesOutReadingsOfRobustWeightZero) {
  const Eigen::VectorXd all = residuals();
  Eigen::VectorXd robust = Eigen::VectorXd::Ones(15);
  robust(2) = 0.0;
  robust(11) = 0.0;
  const LackOfFit test = test_lack_of_fit(rows_in(group_), w_, all, 13.0, 0.0, 0, robust);
  std::vector<int> group;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < 15; ++i) {
    if (robust(i) > 0.0) {
      group.push_back(group_[static_cast<std::size_t>(i)]);
      rows.push_back(i);
    }
  }
  const LackOfFit without = test_lack_of_fit(rows_in(group), w_(rows), all(rows), 11.0, 0.0, 0);
  EXPECT_EQ(test.pure_error_dof, 8.0);
  EXPECT_NEAR(test.pure_error_sd, without.pure_error_sd, 1e-12);
  EXPECT_NEAR(test.f, without.f, 1e-12);
  EXPECT_NEAR(test.p_value, without.p_value, 1e-12);
}

TEST(PureErrorTest, HasNoAnswerWithoutRepeats) {
  const LackOfFit test = test_lack_of_fit(rows_in({0, 1, 2, 3}), Eigen::VectorXd::Ones(4),
                                          Eigen::Vector4d(1.0, -1.0, 1.0, -1.0), 2.0, 0.0, 0);
  EXPECT_EQ(test.pure_error_dof, 0.0);
  EXPECT_TRUE(std::isnan(test.pure_error_sd));
  EXPECT_TRUE(std::isnan(test.f) && std::isnan(test.p_value));
}

TEST(PureErrorTest, TakesRoundingForNoLackOfFit) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(4);
  const Eigen::Vector4d residuals(1e-9, 1e-9, -1e-9, -1e-9);
  const LackOfFit fine = test_lack_of_fit(rows_in({0, 0, 1, 1}), ones, residuals, 3.0, 1e-6, 0);
  EXPECT_EQ(fine.pure_error_sd, 0.0);
  EXPECT_EQ(fine.p_value, 1.0);
  // The repeats agree exactly. If the means differ by more than rounding, that is lack of fit.
  const LackOfFit coarse = test_lack_of_fit(rows_in({0, 0, 1, 1}), ones, residuals, 3.0, 1e-12, 0);
  EXPECT_LT(coarse.p_value, 1e-6);
}

TEST(RequireResponse, NamesTheDeadAxis) {
  ReadingSet set = set_to_regress(5);
  EXPECT_NO_THROW(require_response(set));
  set.response.col(1).setConstant(0.25);
  EXPECT_THAT([&] { require_response(set); },
              testing::ThrowsMessage<RefusedError>(
                  testing::AllOf(HasSubstr("axis y does not respond"), HasSubstr("0.25"))));
  // One different reading is enough, but only if the axis uses it.
  set.response(3, 1) = 1.0;
  EXPECT_NO_THROW(require_response(set));
  set.weights(3, 1) = 0.0;
  EXPECT_THROW(require_response(set), RefusedError);
}

TEST(GroupsOfReadings, AreOfOnePointAndLevel) {
  ReadingSet set = set_to_regress(6, 6);
  set.readings[3].point = set.readings[0].point;
  set.readings[4].point = set.readings[0].point;
  set.readings[4].level = -1.0;
  set.readings[5].point = set.readings[0].point;
  set.readings[5].block = 2;  // repeats may be in different blocks
  EXPECT_THAT(groups_of_readings(set), ElementsAre(0, 1, 2, 0, 3, 0));
}

TEST(GroupsOfReadings, DependOnTheTemperature) {
  ReadingSet set = set_to_regress(7, 6);
  for (Reading& reading : set.readings) {
    reading.point = set.readings.front().point;
  }
  set.temperature.order = 1;
  set.temperature.d = Eigen::MatrixXd::Zero(6, 3);
  // If the temperature is continuous, no two readings are repeats.
  EXPECT_THAT(groups_of_readings(set), ElementsAre(0, 1, 2, 3, 4, 5));
  set.temperature.soak = {0, 0, 1, 1, 0, 2};
  EXPECT_THAT(groups_of_readings(set), ElementsAre(0, 0, 1, 1, 0, 2));
}

TEST(GroupsOfReadings, AreOfOneFieldIfReadingsBringThem) {
  ReadingSet set = set_to_regress(8, 6);
  set.rotation_sensor_from_table.clear();
  for (std::size_t i = 0; i < 6; ++i) {
    set.readings[i].field_in_sensor = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(i % 2));
  }
  EXPECT_THAT(groups_of_readings(set), ElementsAre(0, 1, 0, 1, 0, 1));
  const RegressionRows rows = rows_of_readings(set);
  EXPECT_EQ(rows.group, groups_of_readings(set));
  ASSERT_EQ(rows.rows.size(), 6U);
  EXPECT_THAT(rows.rows[4].runs, ElementsAre(5));
  EXPECT_EQ(rows.rows[4].point, set.readings[4].point);
}

TEST(PutDiagnostics, HasNoNumberForARowWithoutPart) {
  ReadingSet set = set_to_regress(9, 6);
  RegressionRows rows = rows_of_readings(set);
  FitStatistics statistics = blank_statistics(set, rows);
  EXPECT_EQ(statistics.observations, 6);
  EXPECT_EQ(statistics.rows.size(), 6U);
  EXPECT_EQ(statistics.robust_weight.size(), 0);
  Eigen::VectorXd leverage = Eigen::VectorXd::Constant(6, 0.5);
  leverage(2) = 0.0;
  put_diagnostics(statistics, 1, leverage,
                  {.studentized = Eigen::VectorXd::LinSpaced(6, 0.0, 5.0),
                   .cooks_distance = Eigen::VectorXd::Ones(6)},
                  {});
  EXPECT_TRUE(std::isnan(statistics.studentized(2, 1)));
  EXPECT_TRUE(std::isnan(statistics.cooks_distance(2, 1)));
  EXPECT_EQ(statistics.studentized(4, 1), 4.0);
  EXPECT_EQ(statistics.leverage.col(1), leverage);
}

TEST(Summarize, PutsTheAxesOneAfterAnother) {
  ReadingSet set = set_to_regress(10);
  set.effects.columns = Eigen::VectorXd::LinSpaced(set.size(), -0.5, 0.5);
  set.effects.names = {"drift"};
  set.effects.has_drift = true;
  set.weights.row(3).setZero();
  const Eigen::MatrixXd X = set.all_columns(test::rows_of(set, test::sloping_gravity), 0);
  ASSERT_EQ(X.cols(), 5);
  const std::vector<AxisRegression> axes = regressions_of_set(set, X);
  const Estimate estimate = summarize(set, axes, rows_of_readings(set));
  const FitStatistics& statistics = estimate.statistics;
  ASSERT_EQ(statistics.covariance.rows(), 12);  // without the drift's parameters
  for (Eigen::Index k = 0; k < 3; ++k) {
    const LeastSquaresFit& fit = axes[static_cast<std::size_t>(k)].fit;
    EXPECT_EQ(estimate.response.bias(k), fit.estimate(0));
    EXPECT_MATRIX_NEAR(estimate.response.sensitivity.row(k).transpose(), fit.estimate.segment<3>(1),
                       0.0);
    EXPECT_EQ(estimate.effects(0, k), fit.estimate(4));
    EXPECT_MATRIX_NEAR(statistics.covariance.block(4 * k, 4 * k, 4, 4),
                       fit.covariance.topLeftCorner(4, 4), 0.0);
    EXPECT_EQ(statistics.degrees_of_freedom(k), 18.0);
    EXPECT_TRUE(std::isnan(statistics.studentized(3, k)));
  }
  EXPECT_EQ(statistics.covariance.block(0, 4, 4, 8).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_THAT(statistics.observations_per_axis, ElementsAre(23, 23, 23));
  EXPECT_EQ(statistics.lack_of_fit.size(), 3U);
}

}  // namespace
}  // namespace axiscal
