// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/inclination.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace axiscal {
namespace {

// Replaces -pi, which atan2(-0, -1) returns, by pi, because angles are in (-pi, pi].
double half_open(double value) noexcept {
  return value == -std::numbers::pi ? std::numbers::pi : value;
}

double angle(double y, double x) noexcept {
  return half_open(std::atan2(y, x));
}

}  // namespace

Eigen::Matrix3d rotation_sensor_from_level(double pitch_rad,
                                           double roll_rad,
                                           double heading_rad,
                                           AxisConvention convention) {
  const Eigen::Vector3d ahead(std::sin(heading_rad), std::cos(heading_rad), 0.0);
  const Eigen::Vector3d to_left(-std::cos(heading_rad), std::sin(heading_rad), 0.0);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d pitched_up = std::cos(pitch_rad) * up - std::sin(pitch_rad) * ahead;
  Eigen::Matrix3d rotation;  // rows: the axes forward, left, up
  rotation.row(0) = std::cos(pitch_rad) * ahead + std::sin(pitch_rad) * up;
  rotation.row(1) = std::cos(roll_rad) * to_left + std::sin(roll_rad) * pitched_up;
  rotation.row(2) = std::cos(roll_rad) * pitched_up - std::sin(roll_rad) * to_left;
  if (convention == AxisConvention::forward_right_down) {
    rotation.bottomRows<2>() *= -1.0;
  }
  return rotation;
}

AxisElevation elevation_of_axis(double component, double magnitude) noexcept {
  const double sine = component / magnitude;
  return {.angle_rad = std::asin(std::clamp(sine, -1.0, 1.0)), .clamped = std::abs(sine) > 1.0};
}

Inclination inclination_from_field(const Eigen::Vector3d& field_in_sensor,
                                   double magnitude,
                                   const InclinationOptions& options) noexcept {
  const double side = options.convention == AxisConvention::forward_left_up ? 1.0 : -1.0;
  const double x = field_in_sensor.x();
  const double y = side * field_in_sensor.y() + 0.0;  // + 0.0 replaces -0 by 0
  const double z = side * field_in_sensor.z() + 0.0;
  Inclination result;
  if (options.pitch_formula == PitchFormula::arcsine) {
    const AxisElevation pitch = elevation_of_axis(x, magnitude);
    result.pitch_rad = pitch.angle_rad;
    result.clamped = pitch.clamped;
  } else {
    result.pitch_rad = std::atan2(x, std::hypot(y, z));
  }
  result.gives_yaw = std::abs(result.pitch_rad) >= options.yaw_above_rad;
  if (result.gives_yaw) {
    result.yaw_rad = angle(y, x);
  } else {
    result.roll_rad = angle(y, z);
  }
  return result;
}

}  // namespace axiscal
