// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/reading_set.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace axiscal {
namespace {

// Readings of one axis with the given values.
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

TEST(ReadingSet, FindsTheTiltOfItsBlock) {
  ReadingSet set = readings_of_one_axis({1.0, 2.0, 3.0});
  set.readings[0].block = 4;
  set.readings[1].block = 7;
  set.readings[2].block = 4;
  set.readings[2].level = -2.0;
  set.field = set.field.tilted_by_block({4, 7});
  const TableField field = set.field.with({{0.0, 0.0, 1.0}, {0.0, 1.0, 0.0}});
  EXPECT_EQ(set.field_in_table(1, field), field.vector(1));
  EXPECT_EQ(set.field_in_table(2, field), -2.0 * field.vector(0));
  EXPECT_EQ(set.field_change(2, field, 0), -2.0 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(set.field_change(2, field, 1), Eigen::Matrix3d::Zero());
}

Eigen::Matrix3d turned_about_z(double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

// A rotation that is repeated soon is stored once, and one that is repeated late is stored twice.
// Each index returns the rotation that was stored for it.
TEST(Rotations, AreWhatWasPut) {
  Rotations rotations = {turned_about_z(0.0)};
  for (int i = 1; i < 200; ++i) {
    rotations.push_back(turned_about_z(i % 100));
  }
  rotations.put(7, turned_about_z(-1.0));
  ASSERT_EQ(rotations.size(), 200U);
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    EXPECT_EQ(rotations[i], turned_about_z(i == 7 ? -1.0 : static_cast<double>(i % 100))) << i;
  }
  EXPECT_EQ(rotations.back(), turned_about_z(99.0));
  rotations.clear();
  EXPECT_TRUE(rotations.empty());
}

}  // namespace
}  // namespace axiscal
