// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reading_set.hpp"

#include <gtest/gtest.h>

namespace axiscal {
namespace {

// Readings of one axis by their values.
ReadingSet readings_of_one_axis(const std::vector<double>& values) {
  ReadingSet set;
  set.axes = {"x"};
  const auto n = static_cast<Eigen::Index>(values.size());
  set.response.resize(n, 1);
  set.weights = Eigen::MatrixXd::Ones(n, 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    set.readings.push_back(Reading{.run = static_cast<int>(i) + 1});
    set.response(i, 0) = values[static_cast<std::size_t>(i)];
  }
  return set;
}

TEST(ReadingSet, SeesAnAxisAtItsEnd) {
  const std::vector<SaturatedAxis> found = saturated_axes(
      readings_of_one_axis({2.0, 0.31, 2.0, -0.52, 0.17, 2.0, -1.91, 0.08, 1.2}), false);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().value, 2.0);
  EXPECT_EQ(found.front().runs, (std::vector<int>{1, 3, 6}));
}

TEST(ReadingSet, TakesReadingsOfFewDigitsForNoEnd) {
  EXPECT_TRUE(
      saturated_axes(readings_of_one_axis({1.0, 1.0, 1.0, 0.0, 0.0, -1.0, -1.0, -1.0, 0.0}), false)
          .empty());
}

TEST(ReadingSet, TakesTheDarkOfAOneSidedAxisForNoEnd) {
  const ReadingSet set =
      readings_of_one_axis({0.1, 0.31, 0.1, 0.52, 0.17, 0.1, 0.91, 0.18, 1.2, 0.77});
  EXPECT_EQ(saturated_axes(set, false).size(), 1U);
  EXPECT_TRUE(saturated_axes(set, true).empty());
}

TEST(ReadingSet, FindsTheTiltOfItsBlock) {
  ReadingSet set = readings_of_one_axis({1.0, 2.0, 3.0});
  set.readings[0].block = 4;
  set.readings[1].block = 7;
  set.readings[2].block = 4;
  set.readings[2].level = -2.0;
  set.field.tilt_by_block({4, 7});
  const TableField::Vectors fields = {{0.0, 0.0, 1.0}, {0.0, 1.0, 0.0}};
  EXPECT_EQ(set.field_in_table(1, fields), fields[1]);
  EXPECT_EQ(set.field_in_table(2, fields), -2.0 * fields[0]);
  EXPECT_EQ(set.field_change(2, fields, 0), -2.0 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(set.field_change(2, fields, 1), Eigen::Matrix3d::Zero());
}

}  // namespace
}  // namespace axiscal
