// SPDX-License-Identifier: Apache-2.0
// Fits without some readings, and first-order sums of squares, compared with explicit regressions.
#include "calib/mistakes/src/suspect_run.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "calib/fit/estimation.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

ReadingSet suspect_set(int points, std::uint64_t seed, double noise_sd = 1e-3) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            standard_design(points), noise_sd, seed);
}

// A run with a known field, for which first order is exact.
SuspectRun known_run(const ReadingSet& set) {
  return {set, estimate_known(set, set.field), true};
}

SuspectRun open_run(const ReadingSet& set) {
  return {set, estimate_joint(set), false};
}

// Sum of squares of all axes by QR, without the readings `gone` and with the columns `added` (rows
// axis by axis).
double squares_by_hand(const ReadingSet& set,
                       const std::vector<std::size_t>& gone,
                       const Eigen::MatrixXd& added = {}) {
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n * m, 4 * m + added.cols());
  if (added.cols() > 0) {
    A.rightCols(added.cols()) = added;
  }
  Eigen::VectorXd y = set.response.reshaped();
  for (Eigen::Index k = 0; k < m; ++k) {
    A.block(n * k, 4 * k, n, 4) = X;
    for (const std::size_t i : gone) {
      A.row(n * k + static_cast<Eigen::Index>(i)).setZero();
      y(n * k + static_cast<Eigen::Index>(i)) = 0.0;
    }
  }
  return (y - A * A.colPivHouseholderQr().solve(y)).squaredNorm();
}

std::vector<std::size_t> all_positions(std::size_t count) {
  std::vector<std::size_t> all(count);
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

TEST(FirstOf, TakesNoMoreThanThereAre) {
  const std::vector<std::size_t> order = {5, 3, 8};
  EXPECT_EQ(first_of(order, 2), (std::vector<std::size_t>{5, 3}));
  EXPECT_EQ(first_of(order, 3), order);
  EXPECT_EQ(first_of(order, 100), order);
  EXPECT_TRUE(first_of(order, 0).empty());
  EXPECT_TRUE(first_of({}, 4).empty());
}

TEST(ByRun, OrdersByNumberAndKeepsTheOrderOfEqualNumbers) {
  ReadingSet set;
  for (const int run : {7, 2, 7, 1, 2}) {
    set.readings.push_back(Reading{.run = run});
  }
  EXPECT_EQ(order_of_runs(set.readings), (std::vector<std::size_t>{3, 1, 4, 0, 2}));
}

TEST(SquaresBy, SolvesAsAnyFactorisation) {
  RandomStream random(1);
  for (Eigen::Index size = 1; size <= 6; ++size) {
    Eigen::MatrixXd root(size + 2, size);
    for (double& value : root.reshaped()) {
      value = random.normal();
    }
    const Eigen::MatrixXd M = root.transpose() * root;
    const Eigen::VectorXd c = Eigen::VectorXd::LinSpaced(size, -1.0, 2.0);
    const double expected = c.dot(M.fullPivLu().solve(c));
    EXPECT_NEAR(squares_by(M, c, 1e-9), expected, 1e-9 * expected);
    // squares_by() reads the lower triangle only.
    const Eigen::MatrixXd lower = M.triangularView<Eigen::Lower>();
    EXPECT_EQ(squares_by(lower, c, 1e-9), squares_by(M, c, 1e-9));
  }
}

TEST(SquaresBy, IsZeroWhereAPivotIsOpen) {
  Eigen::Matrix2d M;
  M << 1.0, 1.0, 1.0, 1.0;
  EXPECT_EQ(squares_by(M, Eigen::Vector2d(1.0, 1.0), 1e-9), 0.0);
  EXPECT_EQ(squares_by(Eigen::Matrix2d(Eigen::Matrix2d::Zero()), Eigen::Vector2d(1.0, 1.0), 1e-9),
            0.0);
  M(1, 1) = 1.0 + 1e-6;
  EXPECT_EQ(squares_by(M, Eigen::Vector2d(1.0, 2.0), 1e-5), 0.0);
  EXPECT_NEAR(squares_by(M, Eigen::Vector2d(1.0, 2.0), 1e-9), 1.0 + 1e6, 1.0);
}

TEST(SuspectRun, FitsAllReadings) {
  const ReadingSet set = suspect_set(12, 1);
  const SuspectRun run = known_run(set);
  ASSERT_TRUE(run.plain().fitted);
  EXPECT_NEAR(run.plain().total(), squares_by_hand(set, {}), 1e-14);
  EXPECT_EQ(run.n(), 12);
  EXPECT_EQ(run.m(), 3);
  EXPECT_EQ(run.run_of(4), 5);
  EXPECT_EQ(run.order(), all_positions(12));
}

TEST(SuspectRun, LeavesEachReadingOut) {
  ReadingSet set = suspect_set(12, 2);
  set.response(7, 2) += 0.02;
  SuspectRun run = known_run(set);
  run.fit_single_deletions();
  std::vector<double> left;
  for (std::size_t i = 0; i < run.count(); ++i) {
    ASSERT_TRUE(run.without(i).fitted);
    EXPECT_NEAR(run.without(i).total(), squares_by_hand(set, {i}), 1e-14) << i;
    EXPECT_NEAR(run.without(i).dof(), 3.0 * 7.0, 1e-9);
    EXPECT_EQ(run.without(i).residuals.size(), 0);  // dropped, to save memory
    left.push_back(squares_by_hand(set, {i}));
  }
  std::vector<std::size_t> expected = all_positions(12);
  std::sort(expected.begin(), expected.end(),
            [&](std::size_t a, std::size_t b) { return left[a] < left[b]; });
  EXPECT_EQ(run.ranked_by_deletion(), expected);
  EXPECT_EQ(run.ranked_by_deletion().front(), 7U);
}

TEST(SuspectRun, LeavesTheBestPairOfFewReadingsOut) {
  ReadingSet set = suspect_set(12, 3);
  set.response(2, 0) += 0.03;
  set.response(9, 1) -= 0.03;
  SuspectRun run = known_run(set);
  run.fit_single_deletions();
  run.fit_pair_deletions();
  double least = run.plain().total();
  std::array<std::size_t, 2> best{};
  for (std::size_t a = 0; a < run.count(); ++a) {
    for (std::size_t b = a + 1; b < run.count(); ++b) {
      const double squares = squares_by_hand(set, {a, b});
      if (squares < least) {
        least = squares;
        best = {a, b};
      }
    }
  }
  EXPECT_EQ(best, (std::array<std::size_t, 2>{2, 9}));
  EXPECT_NEAR(run.best_pair().total(), least, 1e-14);
  std::array<std::size_t, 2> found = run.pair();
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, best);
}

TEST(SuspectRun, FindsTwoWrongReadingsAmongManyToo) {
  ReadingSet set = suspect_set(24, 4);
  set.response(5, 0) += 0.02;
  set.response(20, 0) += 0.02;
  SuspectRun run = open_run(set);
  run.fit_single_deletions();
  run.fit_pair_deletions();
  std::array<std::size_t, 2> found = run.pair();
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, (std::array<std::size_t, 2>{5, 20}));
  EXPECT_LT(run.best_pair().total(), run.without(run.ranked_by_deletion().front()).total());
  EXPECT_LT(run.without(run.ranked_by_deletion().front()).total(), run.plain().total());
}

// The sum of squares is quadratic in the coefficients, so first order is exact.
TEST(SuspectRun, KnowsWhatReadingsTakeAwayWithoutAFit) {
  for (const int points : {12, 24}) {
    const ReadingSet set = suspect_set(points, 5);
    const SuspectRun run = known_run(set);
    const double all = squares_by_hand(set, {});
    for (const auto& gone : {std::vector<std::size_t>{0}, {3}, {1, 8}, {11, 4}, {0, 5, 10}}) {
      EXPECT_NEAR(run.rss_drop_without_readings(run.plain(), gone),
                  all - squares_by_hand(set, gone), 1e-12);
    }
  }
}

TEST(SuspectRun, KnowsAboutWhatReadingsTakeAwayWhereTheFieldIsOpen) {
  ReadingSet set = suspect_set(12, 6);
  set.response.row(4) += Eigen::RowVector3d(4e-3, -2e-3, 3e-3);
  SuspectRun run = open_run(set);
  run.fit_single_deletions();
  for (std::size_t i = 0; i < run.count(); ++i) {
    const double drop = run.plain().total() - run.without(i).total();
    EXPECT_NEAR(run.rss_drop_without_readings(run.plain(), {&i, 1}), drop, 0.02 * drop) << i;
  }
}

TEST(SuspectRun, KnowsWhatColumnsTakeAwayWithoutAFit) {
  const ReadingSet set = suspect_set(12, 7);
  const SuspectRun run = known_run(set);
  RandomStream random(70);
  for (const Eigen::Index columns : {1, 2, 3}) {
    Eigen::MatrixXd Z(36, columns);
    for (double& value : Z.reshaped()) {
      value = random.normal();
    }
    const double drop = squares_by_hand(set, {}) - squares_by_hand(set, {}, Z);
    EXPECT_NEAR(run.rss_drop_with_columns(run.plain(), Z), drop, 1e-12);
    EXPECT_NEAR(run.rss_drop_with_columns(run.plain(), 1e3 * Z), drop, 1e-12);
  }
  // A constant column equals the bias of the axis, so it explains nothing.
  Eigen::MatrixXd bias = Eigen::MatrixXd::Zero(36, 1);
  bias.middleRows(12, 12).setOnes();
  EXPECT_EQ(run.rss_drop_with_columns(run.plain(), bias), 0.0);
}

TEST(SuspectRun, KnowsWhatAShiftOfSomeReadingsTakesAway) {
  const ReadingSet set = suspect_set(12, 8);
  const SuspectRun run = known_run(set);
  for (const auto& shifted : {std::vector<std::size_t>{4}, {0, 1}, {2, 6, 9, 11}}) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(36, 1);
      for (const std::size_t i : shifted) {
        Z(12 * axis + static_cast<Eigen::Index>(i), 0) = 1.0;
      }
      const double drop = squares_by_hand(set, {}) - squares_by_hand(set, {}, Z);
      EXPECT_NEAR(run.rss_drop_with_shift(run.plain(), axis, shifted), drop, 1e-12);
      EXPECT_NEAR(run.rss_drop_with_columns(run.plain(), Z), drop, 1e-12);
    }
  }
  EXPECT_EQ(run.rss_drop_with_shift(run.plain(), 1, all_positions(12)), 0.0);
}

TEST(SuspectRun, TakesAnArbitraryValueAsADeletion) {
  const ReadingSet set = suspect_set(12, 9);
  SuspectRun run = open_run(set);
  run.fit_single_deletions();
  const HypothesisFit one = run.arbitrary({6});
  ASSERT_TRUE(one.fitted);
  EXPECT_NEAR(one.total(), run.without(6).total(), 1e-8 * one.total());
  EXPECT_MATRIX_NEAR(one.coefficients, run.without(6).coefficients, 1e-8);
  const HypothesisFit two = run.arbitrary({6, 1});
  EXPECT_NEAR(two.total(), run.fitter().fit(set, {1, 6}).total(), 1e-8 * two.total());
  EXPECT_NEAR(run.plain().dof() - two.dof(), 6.0, 1e-6);
}

TEST(SuspectRun, TakesAnArbitraryValueOfOneAxis) {
  const ReadingSet set = suspect_set(12, 10);
  const SuspectRun run = known_run(set);
  const HypothesisFit of_y = run.arbitrary({3}, 1);
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(36, 1);
  Z(15, 0) = 1.0;
  EXPECT_NEAR(of_y.total(), squares_by_hand(set, {}, Z), 1e-14);
  EXPECT_NEAR(run.plain().dof() - of_y.dof(), 1.0, 1e-9);
  EXPECT_MATRIX_NEAR(of_y.coefficients.col(0), run.plain().coefficients.col(0), 1e-12);
  EXPECT_MATRIX_NEAR(of_y.coefficients.col(2), run.plain().coefficients.col(2), 1e-12);
  EXPECT_GT((of_y.coefficients.col(1) - run.plain().coefficients.col(1)).norm(), 1e-6);
}

TEST(SuspectRun, OrdersTheLargestResiduals) {
  ReadingSet set = suspect_set(24, 11);
  set.response(3, 0) += 0.05;
  set.response(17, 2) += 0.1;
  const SuspectRun run = known_run(set);
  EXPECT_EQ(run.largest_residuals(2), (std::vector<std::size_t>{17, 3}));
  const std::vector<std::size_t> all = run.largest_residuals(100);
  ASSERT_EQ(all.size(), 24U);
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  const Eigen::MatrixXd left = set.response - X * X.colPivHouseholderQr().solve(set.response);
  for (std::size_t at = 1; at < all.size(); ++at) {
    EXPECT_GE(left.row(static_cast<Eigen::Index>(all[at - 1])).norm(),
              left.row(static_cast<Eigen::Index>(all[at])).norm());
  }
}

TEST(SuspectRun, WeighsAxesByTheirScatter) {
  ReadingSet set = suspect_set(24, 12, 0.0);
  RandomStream random(120);
  const Eigen::Vector3d noise(1e-4, 1e-3, 1e-2);
  for (Eigen::Index i = 0; i < 24; ++i) {
    set.response.row(i) += noise.cwiseProduct(random.normals<3>()).transpose();
  }
  set.response(8, 0) += 3e-3;  // 30 sigma of axis x, below the noise of axis z
  SuspectRun run = known_run(set);
  run.fit_single_deletions();
  run.fit_pair_deletions();
  EXPECT_NE(run.ranked_by_deletion().front(), 8U);
  for (int round = 0; round < 2; ++round) {
    run.weigh_axes_by(HypothesisFit(run.best_pair()));
  }
  EXPECT_EQ(run.ranked_by_deletion().front(), 8U);
  const Eigen::VectorXd ratio = run.fitter().scale() / run.fitter().scale().maxCoeff();
  EXPECT_NEAR(ratio(2), 1.0, 1e-12);
  EXPECT_NEAR(std::log10(ratio(1)), -1.0, 0.25);
  EXPECT_NEAR(std::log10(ratio(0)), -2.0, 0.25);
  std::vector<std::size_t> sorted = run.ranked_by_deletion();
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(sorted, all_positions(24));
}

TEST(SuspectRun, StartsFromAStatedRatioOfTheNoise) {
  ReadingSet set = suspect_set(12, 13);
  EXPECT_FALSE(known_run(set).stated_ratio());
  EXPECT_MATRIX_NEAR(known_run(set).fitter().scale(), Eigen::Vector3d::Ones(), 0.0);
  set.noise_ratio = Eigen::Vector3d(1.0, 3.0, 10.0);
  const SuspectRun run = known_run(set);
  EXPECT_TRUE(run.stated_ratio());
  EXPECT_MATRIX_NEAR(run.fitter().scale(), set.noise_ratio, 0.0);
}

TEST(SuspectRun, KnowsTheFullResponseOfAnAxis) {
  const ReadingSet set = suspect_set(12, 14, 0.0);
  const SuspectRun run = open_run(set);
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(run.full_response(k),
                test::some_response().sensitivity.row(k).norm() * test::sloping_gravity.norm(),
                1e-9);
  }
}

TEST(SuspectRun, TellsRoundingFromNoise) {
  const ReadingSet exact = suspect_set(12, 15, 0.0);
  EXPECT_TRUE(open_run(exact).only_rounding());
  EXPECT_FALSE(open_run(suspect_set(12, 15, 1e-9)).only_rounding());
  // One noisy axis is enough.
  ReadingSet one = exact;
  one.response(3, 2) += 1e-6;
  EXPECT_FALSE(open_run(one).only_rounding());
}

TEST(SuspectRun, LetsReadingsJudgeEachOtherFrom24On) {
  const ReadingSet all = suspect_set(24, 16);
  EXPECT_TRUE(known_run(all).has_independent_readings());
  ReadingSet fewer = all;
  fewer.readings.pop_back();
  fewer.rotation_sensor_from_table.clear();
  for (std::size_t i = 0; i < 23; ++i) {
    fewer.rotation_sensor_from_table.push_back(all.rotation_sensor_from_table[i]);
  }
  fewer.response = all.response.topRows(23);
  fewer.weights = all.weights.topRows(23);
  EXPECT_FALSE(known_run(fewer).has_independent_readings());
}

// The order of time is that of the run numbers, not of the storage.
TEST(SuspectRun, DoesNotDependOnTheOrderOfStorage) {
  ReadingSet set = suspect_set(12, 17);
  set.response(4, 1) += 5e-3;
  ReadingSet turned = set;
  std::reverse(turned.readings.begin(), turned.readings.end());
  turned.response = set.response.colwise().reverse().eval();
  turned.rotation_sensor_from_table.clear();
  for (std::size_t i = 12; i-- > 0;) {
    turned.rotation_sensor_from_table.push_back(set.rotation_sensor_from_table[i]);
  }
  SuspectRun run = open_run(set);
  SuspectRun other = open_run(turned);
  run.fit_single_deletions();
  other.fit_single_deletions();
  for (std::size_t at = 0; at < 12; ++at) {
    EXPECT_EQ(run.run_of(run.order()[at]), other.run_of(other.order()[at]));
    EXPECT_EQ(run.run_of(run.ranked_by_deletion()[at]),
              other.run_of(other.ranked_by_deletion()[at]));
    EXPECT_NEAR(run.without(at).total(), other.without(11 - at).total(),
                1e-7 * run.plain().total());
  }
}

// If there are more than 200 readings, only the most suspicious ones are fitted. They are ranked
// before the others.
TEST(SuspectRun, FitsTheWorstOfMany) {
  std::vector<DesignEntry> design;
  for (int block = 0; block < 9; ++block) {
    const std::vector<DesignEntry> all = standard_design(24);
    design.insert(design.end(), all.begin(), all.end());
  }
  ReadingSet set = test::labelled_set(
      test::some_response(), test::gravity_in_table(test::sloping_gravity), design, 1e-3, 18);
  set.response(100, 1) += 0.01;
  set.response(30, 0) -= 0.02;
  SuspectRun run = open_run(set);
  ASSERT_GT(run.count(), SuspectRun::each_is_fitted);
  run.fit_single_deletions();
  EXPECT_EQ(first_of(run.ranked_by_deletion(), 2), (std::vector<std::size_t>{30, 100}));
  std::size_t fitted = 0;
  for (std::size_t at = 0; at < run.count(); ++at) {
    const bool is_fitted = run.without(run.ranked_by_deletion()[at]).fitted;
    EXPECT_EQ(is_fitted, at < run.max_candidate_fits()) << at;
    fitted += is_fitted ? 1 : 0;
  }
  EXPECT_EQ(fitted, run.max_candidate_fits());
  std::vector<std::size_t> sorted = run.ranked_by_deletion();
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(sorted, all_positions(run.count()));
  run.fit_pair_deletions();
  std::array<std::size_t, 2> found = run.pair();
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, (std::array<std::size_t, 2>{30, 100}));
}

// If a reading alone determines a coefficient, its residual is 0 and it cannot be left out.
TEST(SuspectRun, KeepsAReadingThatAloneDeterminesACoefficient) {
  const std::vector<DesignEntry> all = standard_design(12);
  // On a level table: four readings with the field along x, one along y and one along z.
  const ReadingSet set =
      test::labelled_set(test::some_response(), test::gravity_in_table(Eigen::Vector3d::UnitZ()),
                         {all[0], all[1], all[2], all[3], all[4], all[8]}, 1e-3, 19);
  SuspectRun run = known_run(set);
  ASSERT_TRUE(run.plain().fitted);
  run.fit_single_deletions();
  for (const std::size_t i : {std::size_t{4}, std::size_t{5}}) {
    EXPECT_EQ(run.rss_drop_without_readings(run.plain(), {&i, 1}), 0.0) << i;
    EXPECT_FALSE(run.without(i).fitted) << i;
    const auto behind =
        std::find(run.ranked_by_deletion().begin(), run.ranked_by_deletion().end(), i);
    EXPECT_GE(behind - run.ranked_by_deletion().begin(), 4);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(run.without(i).fitted) << i;
    EXPECT_NEAR(run.rss_drop_without_readings(run.plain(), {&i, 1}),
                run.plain().total() - run.without(i).total(), 1e-14);
  }
}

// The deleted residual is response - prediction by the others = residual / (1 - h).
TEST(ExpectedByOthers, IsTheDeletedResidual) {
  const ReadingSet set = suspect_set(12, 20);
  SuspectRun run = known_run(set);
  run.fit_single_deletions();
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  const Eigen::MatrixXd H = X * (X.transpose() * X).inverse() * X.transpose();
  const Eigen::MatrixXd left = set.response - H * set.response;
  for (std::size_t i = 0; i < run.count(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const ReadingSet one = one_reading(set, i);
    const Eigen::VectorXd response = set.response.row(row);
    const Eigen::VectorXd deleted = left.row(row).transpose() / (1.0 - H(row, row));
    EXPECT_MATRIX_NEAR(response - predict_from_other_readings(run, one, run.without(i)), deleted,
                       1e-12);
    EXPECT_NEAR(distance_squared(run, one, run.without(i), response), deleted.squaredNorm(), 1e-14);
  }
}

}  // namespace
}  // namespace axiscal
