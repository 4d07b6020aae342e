// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/inclination.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "axiscal/core/random.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// Specific force in forward-left-up at pitch a (nose up) and roll r (right side down). [P] states
// (sin a, -sin r cos a, -cos r cos a) in forward-right-down.
Eigen::Vector3d field_flu(double pitch, double roll) {
  return {std::sin(pitch), std::sin(roll) * std::cos(pitch), std::cos(roll) * std::cos(pitch)};
}

TEST(Inclination, ComesBackFromTheField) {
  for (double pitch_deg = -84.0; pitch_deg <= 84.0; pitch_deg += 12.0) {
    for (double roll_deg = -180.0; roll_deg <= 180.0; roll_deg += 15.0) {
      const Eigen::Vector3d flu = 9.81 * field_flu(pitch_deg * rad_per_deg, roll_deg * rad_per_deg);
      const Eigen::Vector3d frd(flu.x(), -flu.y(), -flu.z());
      InclinationOptions options;
      for (const PitchFormula formula : {PitchFormula::arcsine, PitchFormula::arctangent}) {
        options.pitch_formula = formula;
        options.convention = AxisConvention::forward_left_up;
        const Inclination a = inclination_from_field(flu, 9.81, options);
        options.convention = AxisConvention::forward_right_down;
        const Inclination b = inclination_from_field(frd, 9.81, options);
        // The error of asin grows as 1 / cos(pitch), here to 10 times.
        EXPECT_NEAR(a.pitch_rad * deg_per_rad, pitch_deg, 1e-12);
        EXPECT_NEAR(std::remainder(a.roll_rad * deg_per_rad - roll_deg, 360.0), 0.0, 1e-11);
        EXPECT_EQ(a.pitch_rad, b.pitch_rad);
        EXPECT_EQ(a.roll_rad, b.roll_rad);
        EXPECT_FALSE(a.gives_yaw);
        EXPECT_FALSE(a.clamped);
        EXPECT_GT(a.roll_rad, -std::numbers::pi);
      }
    }
  }
}

TEST(Inclination, NoseUpAndRightSideDownArePositive) {
  // With the nose up the forward axis has a part of the upward force, and with the right side down
  // the left axis has one.
  EXPECT_GT(inclination_from_field({0.1, 0.0, 0.99}, 1.0).pitch_rad, 0.0);
  EXPECT_GT(inclination_from_field({0.0, 0.1, 0.99}, 1.0).roll_rad, 0.0);
}

TEST(Inclination, SwitchesToYawAtTheStatedPitch) {
  const InclinationOptions options{.yaw_above_rad = 80.0 * rad_per_deg};
  EXPECT_FALSE(inclination_from_field(field_flu(79.9 * rad_per_deg, 0.3), 1.0, options).gives_yaw);
  const Eigen::Vector3d f(std::sin(1.45), 0.05,
                          std::sqrt(1 - 0.0025 - std::pow(std::sin(1.45), 2)));
  const Inclination up = inclination_from_field(f, 1.0, options);
  EXPECT_TRUE(up.gives_yaw);
  EXPECT_DOUBLE_EQ(up.yaw_rad, std::atan2(0.05, std::sin(1.45)));
  EXPECT_EQ(up.roll_rad, 0.0);
  // At a pitch of -90 degrees the yaw is near 180 or -180 degrees.
  const Inclination down = inclination_from_field({-1.0, 0.0, 0.0}, 1.0, options);
  EXPECT_DOUBLE_EQ(down.yaw_rad, std::numbers::pi);
  const Inclination just_below = inclination_from_field({-1.0, -0.0, 0.0}, 1.0, options);
  EXPECT_DOUBLE_EQ(just_below.yaw_rad, std::numbers::pi) << "angles lie in (-180, 180]";
}

TEST(Inclination, ClampsAndFlags) {
  const Inclination over = inclination_from_field({1.001, 0.0, 0.0}, 1.0);
  EXPECT_DOUBLE_EQ(over.pitch_rad, std::numbers::pi / 2);
  EXPECT_TRUE(over.clamped);
  EXPECT_FALSE(inclination_from_field({1.0, 0.0, 0.0}, 1.0).clamped);
  EXPECT_TRUE(elevation_of_axis(-1.2, 1.0).clamped);
  EXPECT_DOUBLE_EQ(elevation_of_axis(-1.2, 1.0).angle_rad, -std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(elevation_of_axis(0.5, 1.0).angle_rad, std::numbers::pi / 6);
}

TEST(Inclination, IsNeverNan) {
  RandomStream random(3);
  for (int i = 0; i < 10000; ++i) {
    const Eigen::Vector3d f = random.normals<3>();
    const double size = std::pow(10.0, 100.0 * (random.uniform() - 0.5));
    const Inclination angles = inclination_from_field(size * f, 1.0);
    EXPECT_TRUE(std::isfinite(angles.pitch_rad + angles.roll_rad + angles.yaw_rad));
  }
  const Inclination nothing = inclination_from_field(Eigen::Vector3d::Zero(), 1.0);
  EXPECT_EQ(nothing.pitch_rad, 0.0);
  EXPECT_EQ(nothing.roll_rad, 0.0);
}

}  // namespace
}  // namespace axiscal
