// SPDX-License-Identifier: Apache-2.0
// The half differences of each rest face, compared with predictions by all other readings.
#include "calib/fit/levelness_test.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"
#include "labelled_set.hpp"

namespace axiscal {
namespace {

constexpr double face_noise = 1e-3;

ReadingSet set_of_faces(std::uint64_t seed, int points = 12) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            standard_design(points), face_noise, seed);
}

// The field is known, so the axes share no unknown.
Estimate tested_estimate(const ReadingSet& set) {
  Estimate estimate = estimate_known(set, set.field);
  test_levelness(SolvedReadings(set, true), estimate);
  return estimate;
}

// p of one face: prediction intervals of a textbook for its half differences. The axes are combined
// by Fisher's method.
double p_of_face(const ReadingSet& set, Face face) {
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  std::vector<Eigen::Index> own;
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const bool here = set.readings[static_cast<std::size_t>(i)].point->rest() == face;
    (here ? own : others).push_back(i);
  }
  // One row for each pair of opposite fence faces.
  std::vector<Eigen::RowVectorXd> rows;
  for (std::size_t a = 0; a < own.size(); ++a) {
    for (std::size_t b = 0; b < own.size(); ++b) {
      const DesignPoint& first = *set.readings[static_cast<std::size_t>(own[a])].point;
      const DesignPoint& second = *set.readings[static_cast<std::size_t>(own[b])].point;
      if (is_positive(first.fence()) && second == first.turned_round()) {
        rows.emplace_back(Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(own.size())));
        rows.back()(static_cast<Eigen::Index>(a)) = 0.5;
        rows.back()(static_cast<Eigen::Index>(b)) = -0.5;
      }
    }
  }
  Eigen::MatrixXd K(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(own.size()));
  for (std::size_t r = 0; r < rows.size(); ++r) {
    K.row(static_cast<Eigen::Index>(r)) = rows[r];
  }
  const Eigen::MatrixXd A = X(others, Eigen::all);
  const Eigen::MatrixXd C = (A.transpose() * A).inverse();
  const auto q = static_cast<double>(rows.size());
  const double nu = static_cast<double>(others.size()) - 4.0;
  double fisher = 0.0;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::VectorXd y = set.response.col(k)(others);
    const Eigen::VectorXd b = C * (A.transpose() * y);
    const Eigen::MatrixXd P = K * X(own, Eigen::all);
    const Eigen::VectorXd e = K * set.response.col(k)(own) - P * b;
    const Eigen::MatrixXd V =
        (y - A * b).squaredNorm() / nu * (K * K.transpose() + P * C * P.transpose());
    fisher -= 2.0 * std::log(f_upper_p(e.dot(V.inverse() * e) / q, q, nu));
  }
  return chi_squared_upper_p(fisher, 2.0 * static_cast<double>(set.axis_count()));
}

double p_of_all_faces(const ReadingSet& set) {
  double smallest = 1.0;
  for (const Face face : all_faces) {
    smallest = std::min(smallest, p_of_face(set, face));
  }
  return std::min(1.0, 6.0 * smallest);
}

TEST(TestLevelness, IsThePredictionOfEachFaceByTheOthers) {
  for (const int points : {12, 24}) {
    ReadingSet set = set_of_faces(3, points);
    set.response(4, 0) += 2.5 * face_noise;
    const Estimate estimate = tested_estimate(set);
    const double expected = p_of_all_faces(set);
    ASSERT_GT(expected, 0.005);
    ASSERT_TRUE(estimate.levelness.has_value());
    // The noise of the axes is iterated to a relative change of 1e-6.
    EXPECT_NEAR(estimate.levelness->p_value, expected, 1e-4 * expected) << points;
    EXPECT_TRUE(estimate.levelness->consistent);
    EXPECT_FALSE(estimate.levelness->suspect.has_value());
  }
}

TEST(TestLevelness, NamesTheFaceThatDisagrees) {
  for (const std::size_t wrong : {std::size_t{0}, std::size_t{7}, std::size_t{11}}) {
    ReadingSet set = set_of_faces(4);
    set.response.row(static_cast<Eigen::Index>(wrong)).array() += 0.1;
    const Estimate estimate = tested_estimate(set);
    const Levelness& levelness = *estimate.levelness;
    EXPECT_LT(levelness.p_value, 0.005);
    EXPECT_FALSE(levelness.consistent);
    ASSERT_TRUE(levelness.suspect.has_value());
    EXPECT_EQ(levelness.suspect->point.rest(), set.readings[wrong].point->rest());
    EXPECT_EQ(levelness.suspect->block, 1);
    EXPECT_TRUE(std::isnan(levelness.suspect->x));
    // The test allows for heavy tails, which make p larger.
    EXPECT_GE(levelness.p_value, p_of_all_faces(set) * (1.0 - 1e-4));
  }
}

TEST(TestLevelness, TellsTheBlockOfTheFace) {
  ReadingSet set = set_of_faces(5, 24);
  // Each rest face has readings in two blocks.
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    const DesignPoint& point = *set.readings[i].point;
    const bool next = axis_of(point.fence()) == (axis_of(point.rest()) + 1) % 3;
    set.readings[i].block = next ? 1 : 2;
  }
  set.response.row(13).array() += 0.1;
  const Estimate estimate = tested_estimate(set);
  ASSERT_TRUE(estimate.levelness->suspect.has_value());
  EXPECT_EQ(estimate.levelness->suspect->block, set.readings[13].block);
  EXPECT_EQ(estimate.levelness->suspect->point.rest(), set.readings[13].point->rest());
}

// Each axis is judged by its own scatter, so the units of the readings have no effect.
TEST(TestLevelness, DoesNotKnowTheUnits) {
  ReadingSet set = set_of_faces(6);
  set.response(2, 1) += 3.0 * face_noise;
  const double before = tested_estimate(set).levelness->p_value;
  set.response.col(0) *= 1e3;
  set.response.col(2) *= 1e-4;
  EXPECT_NEAR(tested_estimate(set).levelness->p_value, before, 1e-5 * before);
}

TEST(TestLevelness, DoesNotDependOnTheOrderOfReadings) {
  ReadingSet set = set_of_faces(7, 24);
  const double before = tested_estimate(set).levelness->p_value;
  std::reverse(set.readings.begin(), set.readings.end());
  Rotations reversed;
  for (std::size_t i = set.readings.size(); i-- > 0;) {
    reversed.push_back(set.rotation_sensor_from_table[i]);
  }
  set.rotation_sensor_from_table = reversed;
  set.response = set.response.colwise().reverse().eval();
  EXPECT_NEAR(tested_estimate(set).levelness->p_value, before, 1e-5 * before);
}

TEST(TestLevelness, SaysNoneWithoutALevelness) {
  const ReadingSet set = set_of_faces(8);
  Estimate estimate = estimate_known(set, set.field);
  estimate.levelness.reset();
  test_levelness(SolvedReadings(set, true), estimate);
  EXPECT_FALSE(estimate.levelness.has_value());
}

TEST(TestLevelness, LeavesRobustFitsAlone) {
  ReadingSet set = set_of_faces(9);
  set.response(4, 0) += 0.1;
  Estimate estimate = estimate_known(set, set.field);
  set.robust = true;
  test_levelness(SolvedReadings(set, true), estimate);
  EXPECT_TRUE(std::isnan(estimate.levelness->p_value));
  EXPECT_TRUE(estimate.levelness->consistent);
}

// The readings are on two rest faces. Without one of them the other does not determine the
// sensitivity.
TEST(TestLevelness, HasNoAnswerIfTheOtherFacesDoNotTell) {
  const std::vector<DesignEntry> all = standard_design(24);
  std::vector<DesignEntry> few;
  for (const DesignEntry& entry : all) {
    if (entry.point.rest() == Face::plus_x || entry.point.rest() == Face::plus_y) {
      few.push_back(entry);
    }
  }
  const TableField field = test::gravity_in_table(Eigen::Vector3d(0.3, 0.2, 0.9));
  const ReadingSet set = test::labelled_set(test::some_response(), field, few, face_noise, 10);
  Estimate estimate = estimate_known(set, field);
  ASSERT_TRUE(estimate.levelness.has_value());
  test_levelness(SolvedReadings(set, true), estimate);
  EXPECT_TRUE(std::isnan(estimate.levelness->p_value));
}

// A reading that method paired leaves out is used neither for its face nor for the other faces.
TEST(TestLevelness, DoesNotCountUnpairedReadings) {
  std::vector<DesignEntry> design = standard_design(12);
  const ReadingSet twelve = test::labelled_set(
      test::some_response(), test::gravity_in_table(test::sloping_gravity), design, face_noise, 11);
  for (const DesignEntry& entry : standard_design(24)) {
    const auto same = [&](const DesignEntry& one) { return one.point == entry.point; };
    if (std::none_of(design.begin(), design.end(), same)) {
      design.push_back(entry);
      break;
    }
  }
  ReadingSet set = test::labelled_set(test::some_response(), twelve.field, design, face_noise, 11);
  ASSERT_EQ(set.size(), 13);
  set.response.row(12).array() += 1.0;
  Estimate estimate = tested_estimate(twelve);
  const double expected = estimate.levelness->p_value;
  estimate.unpaired = {12};
  estimate.solution.reset();
  estimate.levelness->p_value = 0.0;
  test_levelness(SolvedReadings(set, true), estimate);
  EXPECT_NEAR(estimate.levelness->p_value, expected, 1e-5 * expected);
}

// Good runs by method joint. The noise differs between the axes.
TEST(TestLevelness, IsRightAboutGoodRuns) {
  constexpr int trials = 300;
  int below_5_percent = 0;
  int below_half_percent = 0;
  for (int trial = 0; trial < trials; ++trial) {
    ReadingSet set = set_of_faces(static_cast<std::uint64_t>(100 + trial));
    RandomStream random(static_cast<std::uint64_t>(trial));
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      set.response(i, 2) += 5.0 * face_noise * random.normal();
    }
    Estimate estimate = estimate_joint(set);
    ASSERT_TRUE(estimate.levelness.has_value());
    test_levelness(SolvedReadings(set, false, estimate.solution), estimate);
    below_5_percent += estimate.levelness->p_value < 0.05 ? 1 : 0;
    below_half_percent += estimate.levelness->consistent ? 0 : 1;
  }
  EXPECT_GE(below_5_percent, 3);
  EXPECT_LE(below_5_percent, 32);
  EXPECT_LE(below_half_percent, 7);
}

}  // namespace
}  // namespace axiscal
