// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/polar_form.hpp"

#include <cmath>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

void check_axis(int nominal_axis) {
  if (nominal_axis < 0 || nominal_axis > 2) {
    throw DomainError("polar form: the nominal axis must be 0, 1 or 2");
  }
}

// Converts a row of S from the given axis convention to forward-right-down, or back.
Eigen::Vector3d other_convention(const Eigen::Vector3d& row, AxisConvention convention) {
  return convention == AxisConvention::forward_right_down
             ? row
             : Eigen::Vector3d(row.x(), -row.y(), -row.z());
}

}  // namespace

PolarForm polar_from_sensitivity(const Eigen::Vector3d& sensitivity,
                                 int nominal_axis,
                                 AxisConvention convention) {
  check_axis(nominal_axis);
  const Eigen::Vector3d T = other_convention(sensitivity, convention);
  const double along = T(nominal_axis);
  const double second = T((nominal_axis + 1) % 3);
  const double third = T((nominal_axis + 2) % 3);
  const double sign = std::signbit(along) ? -1.0 : 1.0;
  return {.sensitivity = sign * T.norm(),
          .coning_angle_rad = std::atan2(std::hypot(second, third), std::abs(along)),
          .azimuth_rad = std::atan2(sign * third + 0.0, sign * second + 0.0)};
}

Eigen::Vector3d sensitivity_from_polar(const PolarForm& polar,
                                       int nominal_axis,
                                       AxisConvention convention) {
  check_axis(nominal_axis);
  Eigen::Vector3d T;
  T(nominal_axis) = std::cos(polar.coning_angle_rad);
  T((nominal_axis + 1) % 3) = std::sin(polar.coning_angle_rad) * std::cos(polar.azimuth_rad);
  T((nominal_axis + 2) % 3) = std::sin(polar.coning_angle_rad) * std::sin(polar.azimuth_rad);
  return other_convention(polar.sensitivity * T, convention);
}

}  // namespace axiscal
