// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/polar_form.hpp"

#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// The three published equations (method.md, section 3.1): response less bias at pitch a and roll R.
double published_response(int axis, const PolarForm& p, double a, double R) {
  const double Om = p.coning_angle_rad;
  const double A = p.azimuth_rad;
  switch (axis) {
    case 0:
      return p.sensitivity *
             (std::cos(Om) * std::sin(a) - std::sin(Om) * std::cos(a) * std::sin(R + A));
    case 1:
      return -p.sensitivity *
             (std::cos(Om) * std::sin(R) * std::cos(a) -
              std::sin(Om) * (std::sin(A) * std::sin(a) - std::cos(A) * std::cos(R) * std::cos(a)));
    default:
      return -p.sensitivity *
             (std::cos(Om) * std::cos(R) * std::cos(a) -
              std::sin(Om) * (std::cos(A) * std::sin(a) - std::sin(A) * std::sin(R) * std::cos(a)));
  }
}

TEST(PolarForm, AgreesWithThePublishedEquations) {
  RandomStream random(11);
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 50; ++i) {
      const PolarForm polar{.sensitivity = 2.0 + random.normal(),
                            .coning_angle_rad = 1.5 * random.uniform(),
                            .azimuth_rad = 6.0 * (random.uniform() - 0.5)};
      const double a = 3.0 * (random.uniform() - 0.5);
      const double R = 6.0 * (random.uniform() - 0.5);
      const Eigen::Vector3d frd(std::sin(a), -std::sin(R) * std::cos(a),
                                -std::cos(R) * std::cos(a));
      const Eigen::Vector3d flu(frd.x(), -frd.y(), -frd.z());
      const double expected = published_response(axis, polar, a, R);
      EXPECT_NEAR(sensitivity_from_polar(polar, axis, AxisConvention::forward_right_down).dot(frd),
                  expected, 1e-14);
      EXPECT_NEAR(sensitivity_from_polar(polar, axis, AxisConvention::forward_left_up).dot(flu),
                  expected, 1e-14);
    }
  }
}

TEST(PolarForm, GoesToAndFro) {
  RandomStream random(12);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d row = random.normals<3>();
    for (const AxisConvention convention :
         {AxisConvention::forward_left_up, AxisConvention::forward_right_down}) {
      const PolarForm polar = polar_from_sensitivity(row, i % 3, convention);
      EXPECT_MATRIX_NEAR(sensitivity_from_polar(polar, i % 3, convention), row, 1e-14);
      EXPECT_GE(polar.coning_angle_rad, 0.0);
      EXPECT_LE(polar.coning_angle_rad, 1.5707963267948968);
    }
  }
}

TEST(PolarForm, HasTheSignOfTheConvention) {
  // In forward-left-up the signs of s_y and s_z are opposite to those of S_yy and S_zz (method.md,
  // section 3.1).
  const auto s = [](const Eigen::Vector3d& row, int axis, AxisConvention convention) {
    return polar_from_sensitivity(row, axis, convention).sensitivity;
  };
  const AxisConvention flu = AxisConvention::forward_left_up;
  const AxisConvention frd = AxisConvention::forward_right_down;
  EXPECT_DOUBLE_EQ(s({2.0, 0.0, 0.0}, 0, flu), 2.0);
  EXPECT_DOUBLE_EQ(s({0.0, 2.0, 0.0}, 1, flu), -2.0);
  EXPECT_DOUBLE_EQ(s({0.0, 0.0, -2.0}, 2, flu), 2.0);
  EXPECT_DOUBLE_EQ(s({0.0, 2.0, 0.0}, 1, frd), 2.0);
  EXPECT_EQ(polar_from_sensitivity({2.0, 0.0, 0.0}, 0, flu).azimuth_rad, 0.0);
  EXPECT_THROW(static_cast<void>(polar_from_sensitivity({1.0, 0.0, 0.0}, 3, flu)), DomainError);
  EXPECT_THROW(static_cast<void>(sensitivity_from_polar({}, -1, flu)), DomainError);
}

}  // namespace
}  // namespace axiscal
