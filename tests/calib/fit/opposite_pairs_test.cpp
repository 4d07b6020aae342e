// SPDX-License-Identifier: Apache-2.0
// Opposite positions, and the slope of the table from their half differences.
#include "calib/fit/src/opposite_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;

constexpr double pair_noise = 1e-3;

LinearResponse plain_response(double S) {
  return {.bias = Eigen::Vector3d(0.1, -0.2, 0.3), .sensitivity = S * Eigen::Matrix3d::Identity()};
}

ReadingSet set_of_pairs(std::uint64_t seed, int points = 12, double noise = pair_noise) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            standard_design(points), noise, seed);
}

// One block for each element of `in_table`, with the same design.
ReadingSet set_of_blocks(const std::vector<Eigen::Vector3d>& in_table, double noise) {
  ReadingSet all;
  for (std::size_t b = 0; b < in_table.size(); ++b) {
    const ReadingSet one = test::labelled_set(
        test::some_response(), test::gravity_in_table(in_table[b]), standard_design(12), noise, b);
    if (b == 0) {
      all = one;
      continue;
    }
    for (std::size_t i = 0; i < one.readings.size(); ++i) {
      all.readings.push_back(one.readings[i]);
      all.readings.back().block = static_cast<int>(b) + 1;
      all.readings.back().run = static_cast<int>(all.readings.size());
      all.rotation_sensor_from_table.push_back(one.rotation_sensor_from_table[i]);
    }
    const Eigen::Index n = all.size();
    all.response.conservativeResize(n + one.size(), Eigen::NoChange);
    all.response.bottomRows(one.size()) = one.response;
    all.weights = Eigen::MatrixXd::Ones(n + one.size(), one.axis_count());
  }
  return all;
}

std::optional<Levelness> levelness_by(const ReadingSet& set,
                                      const SensitivityMatrix& S,
                                      const TableField& field) {
  return estimate_levelness(set, find_opposite_pairs(set).pairs, S, field, field.magnitude());
}

// Half differences of all pairs and their derivatives by the in-plane field. Rows are ordered pair
// by pair, then axis by axis, and scaled to the noise of one reading.
struct HalfDifferences {
  explicit HalfDifferences(const ReadingSet& set, const SensitivityMatrix& S, double normal) {
    for (Eigen::Index a = 0; a < set.size(); ++a) {
      for (Eigen::Index b = 0; b < set.size(); ++b) {
        const Reading& first = set.readings[static_cast<std::size_t>(a)];
        const Reading& second = set.readings[static_cast<std::size_t>(b)];
        if (!is_positive(first.point->fence()) || first.block != second.block ||
            second.point != first.point->turned_round()) {
          continue;
        }
        const Eigen::MatrixXd by_field =
            S *
            (set.rotation_sensor_from_table[static_cast<std::size_t>(a)] -
             set.rotation_sensor_from_table[static_cast<std::size_t>(b)]) /
            2.0;
        for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
          // The variance of half a difference is half of that of one reading, hence the factor
          // sqrt(2).
          const double half = (set.response(a, k) - set.response(b, k)) / 2.0;
          G.conservativeResize(G.rows() + 1, 2);
          d.conservativeResize(d.size() + 1);
          G.bottomRows<1>() = std::numbers::sqrt2 * by_field.row(k).head<2>();
          d.tail<1>()(0) = std::numbers::sqrt2 * (half - normal * by_field(k, 2));
        }
      }
    }
  }

  [[nodiscard]] double squares_left() const {
    return (d - G * G.householderQr().solve(d)).squaredNorm();
  }

  Eigen::MatrixXd G = Eigen::MatrixXd(0, 2);
  Eigen::VectorXd d;
};

TEST(OppositePositions, AreTurnedRoundOnOneFace) {
  const ReadingSet set = set_of_pairs(1);
  const OppositePairs found = opposite_positions(set);
  ASSERT_EQ(found.pairs.size(), 6U);
  EXPECT_TRUE(found.unpaired.empty());
  for (const OppositePair& pair : found.pairs) {
    ASSERT_EQ(pair.first.size(), 1U);
    ASSERT_EQ(pair.second.size(), 1U);
    EXPECT_EQ(set.readings[pair.first[0]].point, pair.point);
    EXPECT_EQ(set.readings[pair.second[0]].point, pair.point.turned_round());
    EXPECT_TRUE(is_positive(pair.point.fence()));
    EXPECT_EQ(pair.mean.size(), 0);  // without readings
  }
  EXPECT_EQ(opposite_positions(set_of_pairs(1, 24)).pairs.size(), 12U);
}

TEST(OppositePositions, DoNotDependOnTheOrder) {
  ReadingSet set = set_of_pairs(2, 24);
  const auto names_of = [](const OppositePairs& found) {
    std::vector<std::string> names;
    for (const OppositePair& pair : found.pairs) {
      names.push_back(pair.point.name());
    }
    std::sort(names.begin(), names.end());
    return names;
  };
  const std::vector<std::string> before = names_of(opposite_positions(set));
  std::reverse(set.readings.begin(), set.readings.end());
  EXPECT_EQ(names_of(opposite_positions(set)), before);
}

TEST(OppositePositions, AreOfOneBlockOneLevelAndOneSoak) {
  ReadingSet set = set_of_pairs(3);
  const OppositePairs all = opposite_positions(set);
  const std::size_t block = all.pairs[0].second[0];
  const std::size_t level = all.pairs[1].first[0];
  const std::size_t soak = all.pairs[2].second[0];
  std::vector<std::size_t> alone;
  for (const std::size_t pair : {0U, 1U, 2U}) {
    alone.push_back(all.pairs[pair].first[0]);
    alone.push_back(all.pairs[pair].second[0]);
  }
  std::sort(alone.begin(), alone.end());
  set.readings[block].block = 2;
  set.readings[level].level = -1.0;
  set.temperature.soak.assign(12, 0);
  set.temperature.soak[soak] = 1;
  const OppositePairs found = opposite_positions(set);
  EXPECT_EQ(found.pairs.size(), 3U);
  EXPECT_EQ(found.unpaired, alone);
}

TEST(FindOppositePairs, AveragesRepeatsByTheirWeights) {
  ReadingSet set = set_of_pairs(4);
  const OppositePairs once = opposite_positions(set);
  const std::size_t a = once.pairs.front().first[0];
  const std::size_t b = once.pairs.front().second[0];
  // A reading of another pair becomes a repeat of the first position.
  const std::size_t repeat = once.pairs.back().first[0];
  set.readings[repeat].point = set.readings[a].point;
  Rotations rotations;
  for (const Reading& reading : set.readings) {
    rotations.push_back(set.orientation(*reading.point));
  }
  set.rotation_sensor_from_table = rotations;
  const auto at = [](std::size_t i) { return static_cast<Eigen::Index>(i); };
  set.weights.row(at(a)) << 1.0, 2.0, 0.0;
  set.weights.row(at(repeat)) << 3.0, 0.5, 0.0;
  set.weights.row(at(b)) << 2.0, 1.0, 1.0;
  const OppositePairs found = find_opposite_pairs(set);
  const auto pair =
      std::find_if(found.pairs.begin(), found.pairs.end(),
                   [&](const OppositePair& one) { return one.point == set.readings[a].point; });
  ASSERT_NE(pair, found.pairs.end());
  EXPECT_EQ(pair->first.size(), 2U);
  for (Eigen::Index k = 0; k < 2; ++k) {
    const double wa = set.weights(at(a), k);
    const double wr = set.weights(at(repeat), k);
    const double wb = set.weights(at(b), k);
    const double first =
        (wa * set.response(at(a), k) + wr * set.response(at(repeat), k)) / (wa + wr);
    const double second = set.response(at(b), k);
    EXPECT_NEAR(pair->mean(k), (first + second) / 2.0, 1e-14);
    EXPECT_NEAR(pair->half_difference(k), (first - second) / 2.0, 1e-14);
    EXPECT_NEAR(pair->weights(k), 4.0 * (wa + wr) * wb / (wa + wr + wb), 1e-13);
  }
  EXPECT_EQ(pair->weights(2), 0.0);  // no used reading on one side
}

// The normal component cancels in the half differences, and the in-plane components cancel in the
// means.
TEST(FindOppositePairs, SeparatesThePlaneFromTheNormal) {
  const OppositePairs found = find_opposite_pairs(set_of_pairs(5, 24));
  ASSERT_EQ(found.pairs.size(), 12U);
  for (const OppositePair& pair : found.pairs) {
    EXPECT_EQ(pair.half_rotation.col(2).norm(), 0.0);
    EXPECT_EQ(pair.mean_rotation.leftCols<2>().norm(), 0.0);
    EXPECT_NEAR(pair.mean_rotation.col(2).norm(), 1.0, 1e-15);
    const Eigen::Matrix3d of_first = pair.mean_rotation + pair.half_rotation;
    EXPECT_MATRIX_NEAR(of_first.transpose() * of_first, Eigen::Matrix3d::Identity(), 1e-15);
  }
}

TEST(PairsByFace, LeaveOutTheDark) {
  ReadingSet set = set_of_pairs(6, 24);
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    if (set.readings[i].point->rest() == Face::plus_x) {
      set.readings[i].level = 0.0;
    }
  }
  const OppositePairs found = opposite_positions(set);
  const Groups faces = pairs_by_face(found.pairs);
  ASSERT_EQ(faces.size(), 5U);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    EXPECT_EQ(faces[f].size(), 2U);
    EXPECT_EQ(found.pairs[faces[f][0]].point.rest(), found.pairs[faces[f][1]].point.rest());
    EXPECT_NE(found.pairs[faces[f][0]].point.rest(), Face::plus_x);
  }
}

// For any field and any invertible S, readings without noise give the true slope.
TEST(EstimateLevelness, IsExactForExactReadings) {
  for (const double F : {1.0, 9.81, 48.0}) {
    const Eigen::Vector3d in_table = F * Eigen::Vector3d(0.02, -0.03, 1.0).normalized();
    const TableField field = test::gravity_in_table(in_table);
    const ReadingSet set =
        test::labelled_set(test::some_response(), field, standard_design(12), 0.0, 1);
    const auto found = levelness_by(set, test::some_response().sensitivity, field);
    ASSERT_TRUE(found.has_value());
    ASSERT_EQ(found->estimates.size(), 6U);
    for (const LevelnessEstimate& one : found->estimates) {
      EXPECT_NEAR(one.x, in_table.x() / F, 1e-13);
      EXPECT_NEAR(one.y, in_table.y() / F, 1e-13);
    }
    EXPECT_NEAR(found->mean_x, in_table.x() / F, 1e-13);
    EXPECT_NEAR(found->mean_y, in_table.y() / F, 1e-13);
    EXPECT_LT(found->sd_x, 1e-13);
  }
}

// The standard error is sigma / (S F sqrt(12)). sigma is the scatter of the half differences about
// one slope.
TEST(EstimateLevelness, HasTheStandardErrorOfTwelveReadings) {
  constexpr double S = 2.5;
  constexpr double F = 9.81;
  const Eigen::Vector3d in_table = F * Eigen::Vector3d(4e-3, -2e-3, 1.0).normalized();
  const TableField field = test::gravity_in_table(in_table);
  const ReadingSet set =
      test::labelled_set(plain_response(S), field, standard_design(12), pair_noise, 8);
  const SensitivityMatrix sensitivity = plain_response(S).sensitivity;
  const auto found = levelness_by(set, sensitivity, field);
  ASSERT_TRUE(found.has_value());
  const HalfDifferences halves(set, sensitivity, in_table.z());
  ASSERT_EQ(halves.d.size(), 18);
  EXPECT_EQ(found->degrees_of_freedom, 16.0);
  const double s = std::sqrt(halves.squares_left() / 16.0);
  EXPECT_NEAR(found->standard_error_x, s / (S * F * std::sqrt(12.0)), 1e-12);
  EXPECT_NEAR(found->standard_error_y, s / (S * F * std::sqrt(12.0)), 1e-12);
  // If all axes have equal sensitivity, the mean of the estimates is the least-squares solution.
  const Eigen::Vector2d together = halves.G.householderQr().solve(halves.d) / F;
  EXPECT_NEAR(found->mean_x, together.x(), 1e-12);
  EXPECT_NEAR(found->mean_y, together.y(), 1e-12);
  double mean = 0.0;
  double squares = 0.0;
  for (const LevelnessEstimate& one : found->estimates) {
    mean += one.x / 6.0;
  }
  for (const LevelnessEstimate& one : found->estimates) {
    squares += std::pow(one.x - mean, 2) / 5.0;
  }
  EXPECT_NEAR(found->mean_x, mean, 1e-14);
  EXPECT_NEAR(found->sd_x, std::sqrt(squares), 1e-14);
}

TEST(EstimateLevelness, ScattersAsItsStandardErrorSays) {
  const SensitivityMatrix S = plain_response(1.0).sensitivity;
  const TableField field = test::gravity_in_table(Eigen::Vector3d::UnitZ());
  constexpr int trials = 400;
  double squares = 0.0;
  double stated = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const ReadingSet set = test::labelled_set(plain_response(1.0), field, standard_design(12),
                                              pair_noise, static_cast<std::uint64_t>(trial));
    const auto found = levelness_by(set, S, field);
    squares += std::pow(found->mean_x, 2) + std::pow(found->mean_y, 2);
    stated += std::pow(found->standard_error_x, 2) + std::pow(found->standard_error_y, 2);
  }
  EXPECT_NEAR(std::sqrt(squares / (2.0 * trials)), pair_noise / std::sqrt(12.0), 3e-5);
  EXPECT_NEAR(squares / stated, 1.0, 0.15);
}

// One axis measures the slope on some faces by its cross-axis terms only, so all half differences
// are fitted together.
TEST(EstimateLevelness, OfOneAxisFitsAllDifferencesTogether) {
  const LinearResponse truth{.bias = Eigen::VectorXd::Constant(1, 0.1),
                             .sensitivity = Eigen::RowVector3d(0.3, -0.2, 2.0)};
  const TableField field = test::gravity_in_table(test::sloping_gravity);
  const ReadingSet set = test::labelled_set(truth, field, standard_design(12), pair_noise, 9);
  const auto found = levelness_by(set, truth.sensitivity, field);
  ASSERT_TRUE(found.has_value());
  EXPECT_TRUE(found->estimates.empty());
  EXPECT_TRUE(std::isnan(found->sd_x));
  const HalfDifferences halves(set, truth.sensitivity, test::sloping_gravity.z());
  const Eigen::Vector2d f = halves.G.householderQr().solve(halves.d) / field.magnitude();
  EXPECT_NEAR(found->mean_x, f.x(), 1e-12);
  EXPECT_NEAR(found->mean_y, f.y(), 1e-12);
  EXPECT_EQ(found->degrees_of_freedom, 4.0);
  const double s2 = halves.squares_left() / 4.0;
  const Eigen::Matrix2d C = s2 * (halves.G.transpose() * halves.G).inverse();
  EXPECT_NEAR(found->standard_error_y, std::sqrt(C(1, 1)) / field.magnitude(), 1e-12);
}

TEST(EstimateLevelness, IsNoneIfOneComponentIsNotSeen) {
  const LinearResponse truth{.bias = Eigen::VectorXd::Constant(1, 0.1),
                             .sensitivity = Eigen::RowVector3d(0.0, 0.0, 2.0)};
  const TableField field = test::gravity_in_table(test::sloping_gravity);
  const std::vector<DesignEntry> two = {{.point = {Face::plus_x, Face::plus_y}},
                                        {.point = {Face::plus_x, Face::minus_y}}};
  const ReadingSet set = test::labelled_set(truth, field, two, pair_noise, 9);
  EXPECT_FALSE(levelness_by(set, truth.sensitivity, field).has_value());
}

TEST(EstimateLevelness, TakesTheLevelOfTheFieldIntoAccount) {
  ReadingSet set = set_of_pairs(10, 12, 0.0);
  const LinearResponse truth = test::some_response();
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    const double level = set.readings[i].point->rest() < Face::plus_y ? -1.0 : 2.0;
    set.readings[i].level = level;
    set.response.row(static_cast<Eigen::Index>(i)) =
        truth.at(level * (set.rotation_sensor_from_table[i] * test::sloping_gravity)).transpose();
  }
  const auto found = levelness_by(set, truth.sensitivity, set.field);
  ASSERT_TRUE(found.has_value());
  for (const LevelnessEstimate& one : found->estimates) {
    EXPECT_NEAR(one.x, test::sloping_gravity.x() / set.field.magnitude(), 1e-13);
    EXPECT_NEAR(one.y, test::sloping_gravity.y() / set.field.magnitude(), 1e-13);
  }
}

// F test of nested models: one slope for all blocks, and one slope for each block.
TEST(EstimateLevelness, ComparesTheSlopesOfBlocks) {
  const SensitivityMatrix S = test::some_response().sensitivity;
  const Eigen::Vector3d other(0.0034, -0.0016, 1.0);
  const ReadingSet moved =
      set_of_blocks({test::sloping_gravity, other, test::sloping_gravity}, pair_noise);
  const auto found = levelness_by(moved, S, moved.field);
  ASSERT_TRUE(found.has_value());
  const double one = HalfDifferences(moved, S, 1.0).squares_left();
  double each = 0.0;
  for (const int block : {1, 2, 3}) {
    ReadingSet own = moved;
    for (std::size_t i = 0; i < own.readings.size(); ++i) {
      if (own.readings[i].block != block) {
        own.readings[i].point = DesignPoint(Face::plus_x, Face::minus_z);  // has no opposite
      }
    }
    each += HalfDifferences(own, S, 1.0).squares_left();
  }
  const double f = ((one - each) / 4.0) / (each / 48.0);
  EXPECT_NEAR(found->block_p_value, f_upper_p(f, 4.0, 48.0), 1e-9);
  const ReadingSet still(set_of_blocks(std::vector(3, test::sloping_gravity), pair_noise));
  EXPECT_GT(levelness_by(still, S, still.field)->block_p_value, 1e-3);
  const ReadingSet far = set_of_blocks({test::sloping_gravity, {0.02, 0.0, 1.0}}, pair_noise);
  EXPECT_LT(levelness_by(far, S, far.field)->block_p_value, 1e-12);
  EXPECT_TRUE(std::isnan(levelness_by(set_of_pairs(1), S, moved.field)->block_p_value));
}

TEST(EstimateLevelness, OfBlocksIsOneForEach) {
  const std::vector<Eigen::Vector3d> in_table = {{0.003, -0.002, 1.0}, {-0.004, 0.001, 1.0}};
  ReadingSet set = set_of_blocks(in_table, 0.0);
  set.field = test::gravity_in_table(Eigen::Vector3d::UnitZ()).tilted_by_block({1, 2});
  const TableField field = set.field.with(in_table);
  const auto found = levelness_by(set, test::some_response().sensitivity, field);
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->blocks.size(), 2U);
  for (std::size_t b = 0; b < 2; ++b) {
    EXPECT_EQ(found->blocks[b].block, static_cast<int>(b) + 1);
    EXPECT_NEAR(found->blocks[b].x, in_table[b].x() / field.magnitude(), 1e-12);
    EXPECT_NEAR(found->blocks[b].y, in_table[b].y() / field.magnitude(), 1e-12);
  }
  EXPECT_TRUE(std::isnan(found->block_p_value));
  EXPECT_EQ(found->current_levelness().block, 2);
}

// A drift would change the slope, so it is subtracted from the readings first.
TEST(LevelnessOf, TakesADriftOff) {
  ReadingSet set = set_of_pairs(11, 24, 0.0);
  set.effects = run_effects(set.readings, set.weights, {.drift = true});
  set.response += 0.05 * set.effects.columns.col(0) * Eigen::RowVector3d(1.0, -2.0, 0.5);
  Estimate estimate = estimate_known(set, set.field);
  put_levelness(set, set.field.magnitude(), estimate);
  ASSERT_TRUE(estimate.levelness.has_value());
  EXPECT_NEAR(estimate.levelness->mean_x, 0.003 / set.field.magnitude(), 1e-12);
  EXPECT_NEAR(estimate.levelness->mean_y, -0.002 / set.field.magnitude(), 1e-12);
  set.effects.has_drift = false;
  put_levelness(set, set.field.magnitude(), estimate);
  EXPECT_GT(estimate.levelness->sd_x + estimate.levelness->sd_y, 1e-3);
}

TEST(PutLevelness, LeavesOutReadingsOfRobustWeightZero) {
  ReadingSet set = set_of_pairs(12, 24);
  Estimate estimate = estimate_known(set, set.field);
  const double F = set.field.magnitude();
  Eigen::MatrixXd robust = Eigen::MatrixXd::Ones(24, 3);
  robust.row(4).setZero();
  estimate.statistics.robust_weight = robust;
  put_levelness(set, F, estimate);
  const Levelness before = *estimate.levelness;
  set.response.row(4).array() += 0.5;
  put_levelness(set, F, estimate);
  EXPECT_NEAR(estimate.levelness->mean_x, before.mean_x, 1e-12);
  EXPECT_NEAR(estimate.levelness->sd_y, before.sd_y, 1e-12);
  estimate.statistics.robust_weight.resize(0, 0);
  put_levelness(set, F, estimate);
  EXPECT_GT(estimate.levelness->sd_x + estimate.levelness->sd_y,
            10.0 * (before.sd_x + before.sd_y));
}

}  // namespace
}  // namespace axiscal
