// SPDX-License-Identifier: Apache-2.0
// The columns for blocks and a drift: their span, and their values at other readings.
#include "calib/fit/run_effects.hpp"

#include <cmath>
#include <utility>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;

// Readings in consecutive blocks with these numbers of readings. Runs are numbered from 1.
std::vector<Reading> readings_in_blocks(const std::vector<int>& sizes) {
  std::vector<Reading> readings;
  for (std::size_t block = 0; block < sizes.size(); ++block) {
    for (int i = 0; i < sizes[block]; ++i) {
      readings.push_back(Reading{.run = static_cast<int>(readings.size()) + 1,
                                 .block = static_cast<int>(block) + 1});
    }
  }
  return readings;
}

Eigen::MatrixXd used_by_two_axes(const std::vector<Reading>& readings) {
  return Eigen::MatrixXd::Ones(static_cast<Eigen::Index>(readings.size()), 2);
}

RunEffects effects_of(const std::vector<Reading>& readings, EffectSetup setup) {
  return run_effects(readings, used_by_two_axes(readings), setup);
}

Eigen::Index rank_with_constant(const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd X(columns.rows(), columns.cols() + 1);
  X << Eigen::VectorXd::Ones(columns.rows()), columns;
  return X.colPivHouseholderQr().rank();
}

void give_times(std::vector<Reading>& readings, double start, double step) {
  for (std::size_t i = 0; i < readings.size(); ++i) {
    readings[i].time_s = start + step * static_cast<double>(i * i);
  }
}

TEST(ProgressOfRun, GoesByOrderWithoutTimes) {
  const std::vector<Reading> readings = readings_in_blocks({5});
  EXPECT_MATRIX_NEAR(progress_of_run(readings), Eigen::VectorXd::LinSpaced(5, -0.5, 0.5), 1e-15);
}

TEST(ProgressOfRun, GoesByTimeIfAllReadingsHaveOne) {
  std::vector<Reading> readings = readings_in_blocks({5});
  give_times(readings, 100.0, 3.0);
  Eigen::VectorXd squares(5);
  squares << 0.0, 1.0, 4.0, 9.0, 16.0;
  EXPECT_MATRIX_NEAR(progress_of_run(readings), (squares.array() / 16.0 - 0.5).matrix(), 1e-12);
  readings[2].time_s.reset();
  EXPECT_MATRIX_NEAR(progress_of_run(readings), Eigen::VectorXd::LinSpaced(5, -0.5, 0.5), 1e-15);
}

TEST(ProgressOfRun, KnowsNeitherUnitNorZeroOfTime) {
  std::vector<Reading> seconds = readings_in_blocks({7});
  std::vector<Reading> hours = seconds;
  give_times(seconds, 1.7e9, 3600.0);
  give_times(hours, 5.0, 1.0);
  EXPECT_MATRIX_NEAR(progress_of_run(seconds), progress_of_run(hours), 1e-12);
}

TEST(ProgressOfRun, GoesByOrderIfAllTimesAreEqual) {
  std::vector<Reading> readings = readings_in_blocks({4});
  give_times(readings, 12.0, 0.0);
  EXPECT_MATRIX_NEAR(progress_of_run(readings), Eigen::VectorXd::LinSpaced(4, -0.5, 0.5), 1e-15);
}

TEST(RunEffectsOfBlocks, AreNoneUnlessAskedFor) {
  const RunEffects effects = effects_of(readings_in_blocks({8, 8}), {});
  EXPECT_EQ(effects.columns.rows(), 16);
  EXPECT_EQ(effects.columns.cols(), 0);
  EXPECT_TRUE(effects.names.empty());
  EXPECT_FALSE(effects.has_block_columns());
}

TEST(RunEffectsOfBlocks, AreNoneForOneBlock) {
  const RunEffects effects = effects_of(readings_in_blocks({12}), {.blocks = true});
  EXPECT_EQ(effects.columns.cols(), 0);
  EXPECT_TRUE(effects.blocks.empty());
}

TEST(RunEffectsOfBlocks, SpanAllChangesThatSumToZero) {
  const std::vector<Reading> readings = readings_in_blocks({6, 9, 7, 8});
  const RunEffects effects = effects_of(readings, {.blocks = true});
  EXPECT_THAT(effects.blocks, ElementsAre(1, 2, 3, 4));
  ASSERT_EQ(effects.columns.cols(), 3);
  EXPECT_EQ(effects.names.size(), 3U);
  EXPECT_EQ(effects.degrees_of_freedom_of_blocks(), 3.0);
  const Eigen::MatrixXd& C = effects.shift_of_block;
  EXPECT_MATRIX_NEAR(C.transpose() * C, Eigen::MatrixXd::Identity(3, 3), 1e-12);
  EXPECT_MATRIX_NEAR(C.colwise().sum(), Eigen::RowVectorXd::Zero(3), 1e-12);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    EXPECT_MATRIX_NEAR(effects.columns.row(static_cast<Eigen::Index>(i)),
                       C.row(readings[i].block - 1), 0.0);
  }
}

// The bias is the mean over the blocks and not over the readings.
TEST(RunEffectsOfBlocks, MakeTheConstantTheMeanOfTheBlocks) {
  const std::vector<int> sizes = {6, 20, 9};
  const std::vector<Reading> readings = readings_in_blocks(sizes);
  const RunEffects effects = effects_of(readings, {.blocks = true});
  const Eigen::Vector3d biases(1.0, -4.0, 9.0);
  Eigen::VectorXd y(35);
  Eigen::MatrixXd X(35, 3);
  X << Eigen::VectorXd::Ones(35), effects.columns;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    y(static_cast<Eigen::Index>(i)) = biases(readings[i].block - 1);
  }
  const Eigen::VectorXd b = X.householderQr().solve(y);
  EXPECT_NEAR(b(0), biases.mean(), 1e-12);
  EXPECT_MATRIX_NEAR(X * b, y, 1e-12);
}

TEST(RunEffectsOfBlocks, LeaveATrendToTheDrift) {
  const std::vector<Reading> readings = readings_in_blocks({8, 8, 8, 8, 8});
  const RunEffects effects = effects_of(readings, {.blocks = true, .drift = true});
  ASSERT_EQ(effects.columns.cols(), 4);  // 5 blocks - 2, plus the drift
  EXPECT_EQ(effects.block_columns(), 3);
  EXPECT_EQ(effects.degrees_of_freedom_of_blocks(), 3.0);
  EXPECT_EQ(effects.names.back(), "drift");
  const Eigen::RowVectorXd trend = Eigen::RowVectorXd::LinSpaced(5, -2.0, 2.0);
  EXPECT_MATRIX_NEAR(trend * effects.shift_of_block, Eigen::RowVectorXd::Zero(4), 1e-12);
  EXPECT_EQ(rank_with_constant(effects.columns), 5);
  EXPECT_MATRIX_NEAR(effects.columns.rightCols<1>(), progress_of_run(readings), 0.0);
}

// Two blocks differ only by a trend, so they keep one column beside the drift.
TEST(RunEffectsOfBlocks, OfTwoBlocksStayWithADrift) {
  const RunEffects effects =
      effects_of(readings_in_blocks({8, 8}), {.blocks = true, .drift = true});
  EXPECT_EQ(effects.block_columns(), 1);
  EXPECT_EQ(effects.columns.cols(), 2);
  EXPECT_EQ(rank_with_constant(effects.columns), 3);
}

TEST(RunEffectsOfBlocks, GiveASmallBlockABiasOfItsOwn) {
  const std::vector<Reading> readings = readings_in_blocks({8, 8, 3, 8, 2});
  const RunEffects effects = effects_of(readings, {.blocks = true});
  EXPECT_THAT(effects.blocks, ElementsAre(1, 2, 4));
  EXPECT_EQ(effects.small_blocks.size(), 2U);
  EXPECT_EQ(effects.block_columns(), 2);
  EXPECT_EQ(effects.degrees_of_freedom_of_blocks(), 2.0);
  EXPECT_THAT(effects.names, ElementsAre("shift of blocks 1", "shift of blocks 2",
                                         "shift of block 3", "shift of block 5"));
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const Eigen::RowVectorXd row = effects.columns.row(static_cast<Eigen::Index>(i));
    EXPECT_EQ(row(2), readings[i].block == 3 ? 1.0 : 0.0);
    EXPECT_EQ(row(3), readings[i].block == 5 ? 1.0 : 0.0);
    if (readings[i].block == 3 || readings[i].block == 5) {
      EXPECT_EQ(row.head(2).norm(), 0.0);
    }
  }
  EXPECT_EQ(rank_with_constant(effects.columns), 5);
}

TEST(RunEffectsOfBlocks, GiveOneLargeBlockNoColumnWithASmallOne) {
  const RunEffects effects = effects_of(readings_in_blocks({12, 2}), {.blocks = true});
  EXPECT_EQ(effects.block_columns(), 0);
  EXPECT_THAT(effects.names, ElementsAre("shift of block 2"));
  EXPECT_EQ(effects.columns.col(0).sum(), 2.0);
}

TEST(RunEffectsOfBlocks, AreNoneIfAllBlocksAreSmall) {
  const RunEffects effects = effects_of(readings_in_blocks({3, 3, 3, 3}), {.blocks = true});
  EXPECT_EQ(effects.columns.cols(), 0);
  EXPECT_TRUE(effects.blocks.empty());
}

TEST(RunEffectsOfBlocks, AreNoneWithManySmallBlocks) {
  std::vector<int> sizes(15, 1);
  sizes[0] = 12;
  sizes[1] = 12;
  EXPECT_EQ(effects_of(readings_in_blocks(sizes), {.blocks = true}).columns.cols(), 0);
  sizes.resize(14);  // 12 small blocks still have biases
  EXPECT_EQ(effects_of(readings_in_blocks(sizes), {.blocks = true}).columns.cols(), 13);
}

// A block is small if any axis uses too few of its readings.
TEST(RunEffectsOfBlocks, CountTheReadingsThatEveryAxisUses) {
  const std::vector<Reading> readings = readings_in_blocks({8, 8, 8});
  Eigen::MatrixXd weights = used_by_two_axes(readings);
  weights.col(1).segment(8, 2).setZero();
  EXPECT_EQ(run_effects(readings, weights, {.blocks = true}).small_blocks.size(), 0U);
  weights(10, 1) = 0.0;
  const RunEffects effects = run_effects(readings, weights, {.blocks = true});
  EXPECT_EQ(effects.small_blocks.size(), 1U);
  EXPECT_THAT(effects.blocks, ElementsAre(1, 3));
}

TEST(RunEffectsOfBlocks, StayInTheScatterIfThereAreVeryMany) {
  const std::vector<int> many(most_block_columns + 1, fewest_readings_of_block);
  const RunEffects effects = effects_of(readings_in_blocks(many), {.blocks = true});
  EXPECT_FALSE(effects.has_block_columns());
  EXPECT_EQ(effects.blocks.size(), many.size());
  EXPECT_EQ(effects.degrees_of_freedom_of_blocks(), static_cast<double>(most_block_columns));
  const std::vector<int> fewer(most_block_columns, fewest_readings_of_block);
  const RunEffects columns = effects_of(readings_in_blocks(fewer), {.blocks = true});
  EXPECT_EQ(columns.block_columns(), static_cast<Eigen::Index>(most_block_columns) - 1);
}

// The span of the columns does not depend on the blocks' numbers.
TEST(RunEffectsOfBlocks, SpanTheSameForOtherNumbers) {
  std::vector<Reading> readings = readings_in_blocks({8, 7, 9});
  const Eigen::MatrixXd before = effects_of(readings, {.blocks = true}).columns;
  for (Reading& reading : readings) {
    reading.block = 100 - 7 * reading.block;
  }
  const Eigen::MatrixXd after = effects_of(readings, {.blocks = true}).columns;
  Eigen::MatrixXd both(before.rows(), before.cols() + after.cols());
  both << before, after;
  EXPECT_EQ(rank_with_constant(both), 3);
}

// The sum of the column over the run is 0, so the bias is the mean of the run.
TEST(StepWithinABlock, LiesBehindItsRunInItsBlock) {
  const std::vector<Reading> readings = readings_in_blocks({8, 8});
  const RunEffects effects =
      effects_of(readings, {.blocks = true, .drift = true, .step_after_run = 3});
  ASSERT_TRUE(effects.step.has_value());
  EXPECT_EQ(effects.step->block, 1);
  EXPECT_EQ(effects.block_columns(), 1);
  EXPECT_EQ(effects.columns_within_blocks(), 2);
  EXPECT_THAT(effects.names, ElementsAre("shift of blocks 1", "step after run 3", "drift"));
  const Eigen::VectorXd column = effects.columns.col(effects.step_column());
  EXPECT_NEAR(column.sum(), 0.0, 1e-12);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const bool behind = readings[i].block == 1 && readings[i].run > 3;
    EXPECT_NEAR(column(static_cast<Eigen::Index>(i)), behind ? 11.0 / 16.0 : -5.0 / 16.0, 1e-12);
  }
  EXPECT_EQ(rank_with_constant(effects.columns), 4);
  EXPECT_MATRIX_NEAR(extrapolate_run_effects(effects, readings, readings), effects.columns, 1e-12);
}

TEST(StepWithinABlock, IsNoneBehindAnUnknownRun) {
  const RunEffects effects = effects_of(readings_in_blocks({8}), {.step_after_run = 77});
  EXPECT_FALSE(effects.step.has_value());
  EXPECT_EQ(effects.columns.cols(), 0);
}

TEST(MemoryOfReadings, IsTheChangeSinceTheReadingBefore) {
  std::vector<Reading> readings = readings_in_blocks({4});
  std::swap(readings[1], readings[2]);  // order of the runs: 1, 3, 2, 4
  Eigen::MatrixXd response(4, 2);
  response << 1.0, -1.0, 5.0, 0.5, 2.0, 0.0, 9.0, 3.0;
  Eigen::MatrixXd expected(4, 2);
  expected << 0.0, 0.0, 2.0 - 5.0, 0.0 - 0.5, 1.0 - 2.0, -1.0 - 0.0, 5.0 - 9.0, 0.5 - 3.0;
  EXPECT_MATRIX_NEAR(previous_minus_current(readings, response), expected, 1e-15);
}

// If a sensor keeps a part of each change, the readings are a regression on this column for each
// axis.
TEST(MemoryOfReadings, IsTheLastColumnOfEachAxis) {
  const std::vector<Reading> readings = readings_in_blocks({8, 8});
  RunEffects effects = effects_of(readings, {.blocks = true, .drift = true});
  const Eigen::MatrixXd before = effects.columns;
  const Eigen::MatrixXd response =
      Eigen::VectorXd::LinSpaced(16, 0.0, 3.0).array().square().matrix() *
      Eigen::RowVector2d(1.0, -2.0);
  add_memory(readings, response, effects);
  EXPECT_EQ(effects.names.back(), "memory");
  EXPECT_EQ(effects.block_columns(), 1);
  EXPECT_EQ(effects.drift_column(), 1);
  const Eigen::MatrixXd memory = previous_minus_current(readings, response);
  for (const Eigen::Index i : {0, 7, 15}) {
    for (const Eigen::Index k : {0, 1}) {
      const Eigen::RowVectorXd row = effects.row(i, k);
      ASSERT_EQ(row.size(), 3);
      EXPECT_MATRIX_NEAR(row.head(2), before.row(i), 0.0);
      EXPECT_EQ(row(2), memory(i, k));
    }
  }
  const RunEffects means = effects.of_means({{0, 1, 2}, {7}, {10, 15}});
  ASSERT_EQ(means.columns.rows(), 3);
  for (const Eigen::Index k : {0, 1}) {
    const Eigen::RowVectorXd three =
        (effects.row(0, k) + effects.row(1, k) + effects.row(2, k)) / 3.0;
    EXPECT_MATRIX_NEAR(means.row(0, k), three, 1e-15);
    EXPECT_MATRIX_NEAR(means.row(1, k), effects.row(7, k), 0.0);
    EXPECT_MATRIX_NEAR(means.row(2, k), (effects.row(10, k) + effects.row(15, k)) / 2.0, 1e-15);
  }
}

class EffectsAt : public testing::TestWithParam<bool> {
 protected:
  EffectsAt() {
    if (GetParam()) {
      give_times(run_, 1000.0, 2.0);
    }
    effects_ = effects_of(run_, {.blocks = true, .drift = true});
  }

  [[nodiscard]] Eigen::MatrixXd of(const std::vector<Reading>& others) const {
    return extrapolate_run_effects(effects_, run_, others);
  }

  std::vector<Reading> run_ = readings_in_blocks({8, 8, 8});
  RunEffects effects_;
};

TEST_P(EffectsAt, AreTheColumnsOfTheRunAtItsOwnReadings) {
  EXPECT_MATRIX_NEAR(of(run_), effects_.columns, 1e-12);
  // The readings may have any order and number.
  EXPECT_MATRIX_NEAR(of({run_[17], run_[3]}), effects_.columns({17, 3}, Eigen::all), 1e-12);
}

TEST_P(EffectsAt, TakeAnUnknownBlockForTheMeanOfTheKnownOnes) {
  std::vector<Reading> others = {run_[5]};
  others.front().block = 9;
  const Eigen::MatrixXd columns = of(others);
  EXPECT_EQ(columns.leftCols(effects_.block_columns()).norm(), 0.0);
  EXPECT_NEAR(columns(0, columns.cols() - 1), effects_.columns.rightCols<1>()(5), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Times, EffectsAt, testing::Bool(), [](const auto& timed) {
  return timed.param ? "timed" : "by_order";
});

TEST(EffectsAtOthers, LetTheDriftGoOn) {
  const std::vector<Reading> run = readings_in_blocks({11});
  const RunEffects effects = effects_of(run, {.drift = true});
  std::vector<Reading> others(3, run.front());
  others[0].run = 21;  // one length of the run after its end
  others[1].run = -4;  // half a length before its start
  others[2].run = 6;   // in the middle of the run
  const Eigen::MatrixXd columns = extrapolate_run_effects(effects, run, others);
  EXPECT_MATRIX_NEAR(columns, Eigen::Vector3d(1.5, -1.0, 0.0), 1e-12);
}

// A reading that is kept out leaves a gap in the run numbers, so its column is between those of its
// neighbours.
TEST(EffectsAtOthers, StandBetweenTheirNeighbours) {
  std::vector<Reading> run = readings_in_blocks({5});
  const Reading between = run[2];
  run.erase(run.begin() + 2);
  const RunEffects effects = effects_of(run, {.drift = true});
  EXPECT_MATRIX_NEAR(extrapolate_run_effects(effects, run, {between}), Eigen::MatrixXd::Zero(1, 1),
                     1e-12);
}

TEST(EffectsAtOthers, GoByTimeIfAllHaveOne) {
  std::vector<Reading> run = readings_in_blocks({4});
  give_times(run, 50.0, 1.0);  // times 50, 51, 54, 59 s
  const RunEffects effects = effects_of(run, {.drift = true});
  std::vector<Reading> others(2, run.front());
  others[0].time_s = 54.5;
  others[1].time_s = 68.0;
  EXPECT_MATRIX_NEAR(extrapolate_run_effects(effects, run, others), Eigen::Vector2d(0.0, 1.5),
                     1e-12);
}

TEST(EffectsAtOthers, HaveNoColumnsIfTheRunHasNone) {
  const std::vector<Reading> run = readings_in_blocks({6});
  const Eigen::MatrixXd columns =
      extrapolate_run_effects(effects_of(run, {}), run, {run[0], run[1]});
  EXPECT_EQ(columns.rows(), 2);
  EXPECT_EQ(columns.cols(), 0);
}

}  // namespace
}  // namespace axiscal
