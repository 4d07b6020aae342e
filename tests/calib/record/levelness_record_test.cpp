// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>

#include <Eigen/QR>
#include <gmock/gmock.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/correction.hpp"
#include "axiscal/calib/levelness.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// ---- the levelness of a record ----

TEST(LevelnessOfTable, IsTheMeanOfARunWithOneLevelness) {
  const Levelness levelness{
      .mean_x = 1e-3, .mean_y = -2e-3, .standard_error_x = 1e-5, .standard_error_y = 2e-5};
  const BlockLevelness stands = levelness.current_levelness();
  EXPECT_EQ(stands.x, 1e-3);
  EXPECT_EQ(stands.y, -2e-3);
  EXPECT_EQ(stands.standard_error_x, 1e-5);
  EXPECT_EQ(stands.standard_error_y, 2e-5);
  EXPECT_EQ(stands.block, 1);
  // The position is ignored, because there is one levelness for all blocks.
  EXPECT_EQ(levelness.of_block_at(0), Eigen::Vector2d(1e-3, -2e-3));
  EXPECT_EQ(levelness.of_block_at(5), Eigen::Vector2d(1e-3, -2e-3));
}

TEST(LevelnessOfTable, IsThatOfTheLastBlockIfEachHasOne) {
  Levelness levelness{.mean_x = 9.0, .mean_y = 9.0};
  levelness.blocks = {{.block = 2, .x = 1e-3, .y = 2e-3},
                      {.block = 7, .x = 3e-3, .y = 4e-3, .standard_error_x = 5e-6}};
  EXPECT_EQ(levelness.current_levelness().block, 7);
  EXPECT_EQ(levelness.current_levelness().x, 3e-3);
  EXPECT_EQ(levelness.current_levelness().standard_error_x, 5e-6);
  EXPECT_EQ(levelness.of_block_at(0), Eigen::Vector2d(1e-3, 2e-3));
  EXPECT_EQ(levelness.of_block_at(1), Eigen::Vector2d(3e-3, 4e-3));
  EXPECT_THROW(static_cast<void>(levelness.of_block_at(2)), std::out_of_range);
}

// The slope by the two opposite readings of one rest face. The bias cancels.
Eigen::Vector2d slope_by_pair(const SensorModel& sensor,
                              const DesignPoint& point,
                              const Eigen::VectorXd& first,
                              const Eigen::VectorXd& turned) {
  const Positioner cube;
  const Eigen::Matrix3d difference =
      0.5 * (cube.rotation_table_from_positioner(point).transpose() -
             cube.rotation_table_from_positioner(point.turned_round()).transpose());
  const Eigen::MatrixXd G = sensor.response.sensitivity * difference.leftCols<2>();
  return G.colPivHouseholderQr().solve(0.5 * (first - turned));
}

// @return the mean response at each design point of a run.
std::map<DesignPoint, Eigen::VectorXd> means_of_points(const Observations& run) {
  std::map<DesignPoint, Eigen::VectorXd> sums;
  std::map<DesignPoint, double> counts;
  for (std::size_t i = 0; i < run.readings.size(); ++i) {
    const DesignPoint point = *run.readings[i].point;
    const Eigen::VectorXd v = run.response.row(static_cast<Eigen::Index>(i));
    sums[point] = counts[point] == 0.0 ? v : Eigen::VectorXd(sums[point] + v);
    counts[point] += 1.0;
  }
  for (auto& [point, sum] : sums) {
    sum /= counts[point];
  }
  return sums;
}

TEST(LevelnessOfFaces, AreTheTablesSlopeWithoutNoise) {
  const SensorModel truth = test::accelerometer_truth();
  for (const Method method : {Method::paired, Method::joint}) {
    for (const Eigen::Vector2d& slope :
         {Eigen::Vector2d(0.004, -0.003), Eigen::Vector2d(-0.02, 0.0)}) {
      Experiment experiment = test::experiment_for(truth);
      experiment.fit.method = method;
      const Calibration found =
          calibrate(experiment, test::observe(truth, {.slope = slope, .seed = 4}));
      ASSERT_TRUE(found.fit.levelness);
      const Levelness& levelness = *found.fit.levelness;
      EXPECT_NEAR(levelness.mean_x, slope.x(), 1e-12);
      EXPECT_NEAR(levelness.mean_y, slope.y(), 1e-12);
      ASSERT_EQ(levelness.estimates.size(), 6U);
      for (const LevelnessEstimate& one : levelness.estimates) {
        EXPECT_NEAR(one.x, slope.x(), 1e-11) << one.point.name();
        EXPECT_NEAR(one.y, slope.y(), 1e-11) << one.point.name();
      }
      EXPECT_NEAR(levelness.sd_x, 0.0, 1e-11);
      EXPECT_THAT(levelness.blocks, IsEmpty());
      EXPECT_EQ(levelness.current_levelness().x, levelness.mean_x);
    }
  }
}

TEST(LevelnessOfFaces, AreThoseOfOppositeReadings) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::paired;
  const Observations run =
      test::observe(truth, {.slope = {0.004, -0.003}, .noise_sd = 1e-4, .seed = 5});
  const Calibration found = calibrate(experiment, run);
  const std::map<DesignPoint, Eigen::VectorXd> means = means_of_points(run);
  ASSERT_TRUE(found.fit.levelness);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector2d> all;
  for (const LevelnessEstimate& one : found.fit.levelness->estimates) {
    const Eigen::Vector2d expected = slope_by_pair(found.sensor, one.point, means.at(one.point),
                                                   means.at(one.point.turned_round()));
    // The weights of the axes change an estimate by less than its noise.
    EXPECT_NEAR(one.x, expected.x(), 2e-6) << one.point.name();
    EXPECT_NEAR(one.y, expected.y(), 2e-6) << one.point.name();
    all.emplace_back(one.x, one.y);
    sum += all.back();
  }
  ASSERT_EQ(all.size(), 6U);
  const Eigen::Vector2d mean = sum / 6.0;
  EXPECT_NEAR(found.fit.levelness->mean_x, mean.x(), 2e-6);
  EXPECT_NEAR(found.fit.levelness->mean_y, mean.y(), 2e-6);
  Eigen::Array2d squares = Eigen::Array2d::Zero();
  for (const Eigen::Vector2d& one : all) {
    squares += (one - mean).array().square();
  }
  EXPECT_NEAR(found.fit.levelness->sd_x, std::sqrt(squares.x() / 5.0), 2e-6);
  EXPECT_NEAR(found.fit.levelness->sd_y, std::sqrt(squares.y() / 5.0), 2e-6);
  EXPECT_TRUE(found.fit.levelness->consistent);
  EXPECT_FALSE(found.fit.levelness->suspect);
}

// The standard error is sigma / sqrt(12) for a sensitivity of 1. Here the sensitivity is 2.5.
TEST(LevelnessOfFaces, HaveAMeanAsGoodAsTheNoiseAllows) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::paired;
  experiment.fit.seats = SeatSetup::none;
  constexpr double noise_sd = 1e-3;
  constexpr int runs = 60;
  double error_squares = 0.0;
  double stated_squares = 0.0;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const Levelness levelness =
        *calibrate(experiment, test::observe(truth, {.noise_sd = noise_sd, .seed = seed}))
             .fit.levelness;
    error_squares += std::pow(levelness.mean_x, 2) + std::pow(levelness.mean_y, 2);
    stated_squares += std::pow(levelness.standard_error_x, 2);
  }
  const double expected = noise_sd / std::sqrt(12.0) / 2.5;
  EXPECT_NEAR(std::sqrt(error_squares / (2.0 * runs)) / expected, 1.0, 0.25);
  EXPECT_NEAR(std::sqrt(stated_squares / runs) / expected, 1.0, 0.2);
}

// The slope of the table differs between three days.
TEST(LevelnessOfBlocks, IsEachBlocksSlope) {
  const SensorModel truth = test::accelerometer_truth();
  const std::vector<Eigen::Vector2d> slopes = {{0.003, 0.001}, {-0.002, 0.004}, {0.0, -0.001}};
  std::vector<Observations> days;
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    days.push_back(test::observe(truth, {.slope = slopes[i], .seed = i + 1}));
  }
  for (const Method method : {Method::paired, Method::joint}) {
    Experiment experiment = test::experiment_for(truth);
    experiment.fit.method = method;
    experiment.fit.level_by = LevelBy::block;
    const Calibration found = calibrate(experiment, concatenate(days));
    ASSERT_TRUE(found.fit.levelness);
    const Levelness& levelness = *found.fit.levelness;
    ASSERT_EQ(levelness.blocks.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(levelness.blocks[i].block, static_cast<int>(i) + 1);
      EXPECT_MATRIX_NEAR(levelness.of_block_at(i), slopes[i], 1e-11);
    }
    EXPECT_NEAR(levelness.current_levelness().y, -0.001, 1e-11);
    // The levelness is the same after the record is written and read.
    const Levelness back = *parse_calibration(calibration_json(found), "record.json").fit.levelness;
    EXPECT_EQ(back.current_levelness().x, levelness.current_levelness().x);
    EXPECT_EQ(back.current_levelness().block, 3);
    EXPECT_EQ(back.of_block_at(1), levelness.of_block_at(1));
  }
}

// ---- observations put together ----

// Readings of two axes. Their values identify file and row.
Observations numbered_part(int file, const std::vector<int>& blocks) {
  Observations part;
  const auto n = static_cast<Eigen::Index>(blocks.size());
  part.response.resize(n, 2);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const int row = static_cast<int>(i) + 1;
    part.readings.push_back({.run = row, .block = blocks[i]});
    part.response.row(row - 1) << 100.0 * file + row, -(100.0 * file + row);
  }
  return part;
}

std::vector<int> runs_in(const Observations& observations) {
  std::vector<int> runs;
  for (const Reading& reading : observations.readings) {
    runs.push_back(reading.run);
  }
  return runs;
}

std::vector<int> blocks_in(const Observations& observations) {
  std::vector<int> blocks;
  for (const Reading& reading : observations.readings) {
    blocks.push_back(reading.block);
  }
  return blocks;
}

TEST(JoinedObservations, NumberBlocksOnAndKeepTheirDistances) {
  const Observations all =
      concatenate({numbered_part(1, {1, 2}), numbered_part(2, {3, 3, 5}), numbered_part(3, {1})});
  EXPECT_THAT(runs_in(all), ElementsAre(1, 2, 3, 4, 5, 6));
  // The second part has blocks 3 and 5. They are renumbered after the blocks of the first part,
  // with the same difference.
  const std::vector<int> blocks = blocks_in(all);
  EXPECT_EQ(blocks[0], 1);
  EXPECT_EQ(blocks[1], 2);
  EXPECT_EQ(blocks[2], blocks[3]);
  EXPECT_GT(blocks[2], blocks[1]);
  EXPECT_EQ(blocks[4] - blocks[3], 2);
  EXPECT_EQ(blocks[5], blocks[4] + 1);
  EXPECT_EQ(all.response.rows(), 6);
  EXPECT_EQ(all.response(2, 0), 201.0);
  EXPECT_EQ(all.response(5, 1), -301.0);
  EXPECT_TRUE(all.has_block);
}

TEST(JoinedObservations, DoNotDependOnTheOrderOfJoining) {
  const std::vector<Observations> parts = {numbered_part(1, {1, 1, 2}), numbered_part(2, {1, 2}),
                                           numbered_part(3, {1, 3})};
  const Observations at_once = concatenate(parts);
  const Observations left = concatenate({concatenate({parts[0], parts[1]}), parts[2]});
  const Observations right = concatenate({parts[0], concatenate({parts[1], parts[2]})});
  for (const Observations& other : {left, right}) {
    EXPECT_EQ(other.response, at_once.response);
    EXPECT_EQ(runs_in(other), runs_in(at_once));
    EXPECT_EQ(blocks_in(other), blocks_in(at_once));
  }
}

TEST(JoinedObservations, OfOnePartStayAsTheyAre) {
  Observations part = numbered_part(1, {4, 9});
  part.readings[0].run = 17;
  const Observations same = concatenate({part});
  EXPECT_THAT(runs_in(same), ElementsAre(17, 2));
  EXPECT_THAT(blocks_in(same), ElementsAre(4, 9));
  EXPECT_FALSE(same.has_block);
}

TEST(JoinedObservations, KeepSamplesAndScatterIfAllPartsHaveThem) {
  Observations one = numbered_part(1, {1, 1});
  Observations two = numbered_part(2, {1});
  one.samples = Eigen::Vector2d(10.0, 20.0);
  two.samples = Eigen::VectorXd::Constant(1, 30.0);
  one.response_sd = Eigen::Matrix2d::Constant(0.5);
  two.response_sd = Eigen::MatrixXd::Constant(1, 2, 0.25);
  const Observations all = concatenate({one, two});
  EXPECT_EQ(*all.samples, Eigen::Vector3d(10.0, 20.0, 30.0));
  EXPECT_EQ(all.response_sd->row(2), Eigen::RowVector2d(0.25, 0.25));
  EXPECT_EQ(all.response_sd->rows(), 3);
  // Standard deviations that only one file states are dropped.
  two.response_sd.reset();
  EXPECT_FALSE(concatenate({one, two}).response_sd);
  EXPECT_FALSE(concatenate({two, one}).response_sd);
}

TEST(JoinedObservations, HaveALevelIfAnyHasAndAFenceIfAllHave) {
  Observations one = numbered_part(1, {1});
  Observations two = numbered_part(2, {1});
  EXPECT_TRUE(concatenate({one, two}).has_fence);
  EXPECT_FALSE(concatenate({one, two}).has_level);
  two.has_level = true;
  two.has_fence = false;
  for (const Observations& all : {concatenate({one, two}), concatenate({two, one})}) {
    EXPECT_TRUE(all.has_level);
    EXPECT_FALSE(all.has_fence);
  }
}

TEST(JoinedObservations, KeepSaturatedReadings) {
  Observations one = numbered_part(1, {1, 1});
  Observations two = numbered_part(2, {1});
  one.saturated = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>::Constant(2, 2, false);
  (*one.saturated)(1, 0) = true;
  two.saturated = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>::Constant(1, 2, true);
  const Observations all = concatenate({one, two});
  EXPECT_EQ(all.saturated->cast<int>().sum(), 3);
  EXPECT_TRUE((*all.saturated)(1, 0));
  EXPECT_TRUE((*all.saturated)(2, 1));
  two.saturated.reset();
  EXPECT_THAT(test::complaint_of<DomainError>([&] {
                static_cast<void>(concatenate({one, two}));
              }),
              HasSubstr("saturated"));
}

TEST(JoinedObservations, MustHaveTheSameAxesAndRoomForNumbers) {
  const Observations two_axes = numbered_part(1, {1});
  Observations three_axes = two_axes;
  three_axes.response = Eigen::RowVector3d(1.0, 2.0, 3.0);
  EXPECT_THAT(test::complaint_of<DomainError>([&] {
                static_cast<void>(concatenate({two_axes, three_axes}));
              }),
              HasSubstr("numbers of axes differ"));
  Observations last_block = two_axes;
  last_block.readings[0].block = std::numeric_limits<int>::max();
  EXPECT_THAT(test::complaint_of<DomainError>([&] {
                static_cast<void>(concatenate({last_block, two_axes}));
              }),
              HasSubstr("too large"));
}

// ---- some of the readings ----

Observations observed_with_everything() {
  const SensorModel truth = test::accelerometer_truth();
  Observations all = test::observe(truth, {.replicates = 2, .noise_sd = 1e-3, .seed = 8});
  const Eigen::Index n = all.size();
  all.samples = Eigen::VectorXd::LinSpaced(n, 1.0, static_cast<double>(n));
  all.response_sd = 2.0 * all.response;
  all.saturated = (all.response.array() > 0.0).eval();
  all.has_fence = false;
  return all;
}

TEST(SelectedRows, BringAllThatIsSaidOfThem) {
  const Observations all = observed_with_everything();
  const std::vector<std::size_t> rows = {5, 0, 23, 5};
  const Observations some = select_rows(all, rows);
  ASSERT_EQ(some.size(), 4);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto from = static_cast<Eigen::Index>(rows[i]);
    const auto to = static_cast<Eigen::Index>(i);
    EXPECT_EQ(some.readings[i].run, all.readings[rows[i]].run);
    EXPECT_EQ(some.readings[i].point, all.readings[rows[i]].point);
    EXPECT_EQ(some.response.row(to), all.response.row(from));
    EXPECT_EQ((*some.samples)(to), static_cast<double>(rows[i]) + 1.0);
    EXPECT_EQ(some.response_sd->row(to), all.response_sd->row(from));
    EXPECT_TRUE((some.saturated->row(to) == all.saturated->row(from)).all());
  }
  EXPECT_EQ(some.has_block, all.has_block);
  EXPECT_FALSE(some.has_fence);
  EXPECT_EQ(select_rows(all, {}).size(), 0);
  EXPECT_EQ(select_rows(all, {}).response.cols(), 3);
}

TEST(SelectedRows, ComeBackByTheInverseOrder) {
  const Observations all = observed_with_everything();
  std::vector<std::size_t> order(static_cast<std::size_t>(all.size()));
  std::iota(order.begin(), order.end(), std::size_t{0});
  RandomStream random(9);
  random.shuffle(std::span(order));
  std::vector<std::size_t> inverse(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    inverse[order[i]] = i;
  }
  const Observations back = select_rows(select_rows(all, order), inverse);
  EXPECT_EQ(back.response, all.response);
  EXPECT_EQ(*back.samples, *all.samples);
  EXPECT_EQ(runs_in(back), runs_in(all));
}

TEST(SelectedRows, TakePartsOfJoinedObservationsApart) {
  const Observations one = numbered_part(1, {1, 1, 1});
  const Observations two = numbered_part(2, {1, 1});
  const Observations all = concatenate({one, two});
  EXPECT_EQ(select_rows(all, {0, 1, 2}).response, one.response);
  EXPECT_EQ(select_rows(all, {3, 4}).response, two.response);
}

// ---- corrections ----

TEST(CorrectedObservations, ChangeOnlyTheRunsThatAreNamed) {
  const Observations run = test::observe(test::accelerometer_truth(), {.noise_sd = 1e-3});
  Correction correction;
  const DesignPoint point(Face::plus_y, Face::minus_x);
  correction.points = {{3, point}};
  correction.responses = {{5, Eigen::Vector3d(7.0, 8.0, 9.0)}};
  correction.levels = {{8, FieldLevel(-1.0)}};
  correction.leave_out = {9};
  const Observations mended = corrected(run, correction);
  ASSERT_EQ(mended.size(), run.size());
  for (std::size_t i = 0; i < mended.readings.size(); ++i) {
    const int number = run.readings[i].run;
    const auto row = static_cast<Eigen::Index>(i);
    EXPECT_EQ(mended.readings[i].run, number);
    EXPECT_EQ(*mended.readings[i].point, number == 3 ? point : *run.readings[i].point);
    EXPECT_EQ(mended.readings[i].level, FieldLevel(number == 8 ? -1.0 : 1.0));
    const Eigen::RowVector3d expected =
        number == 5 ? Eigen::RowVector3d(7.0, 8.0, 9.0) : Eigen::RowVector3d(run.response.row(row));
    EXPECT_EQ(mended.response.row(row), expected);
  }
}

}  // namespace
}  // namespace axiscal
