// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/inclination.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace axiscal {
namespace {

// atan2 gives -pi for (-0, -1); our angles lie in (-pi, pi].
double angle(double y, double x) noexcept {
  const double value = std::atan2(y, x);
  return value == -std::numbers::pi ? std::numbers::pi : value;
}

}  // namespace

AxisElevation elevation_of_axis(double component, double magnitude) noexcept {
  const double sine = component / magnitude;
  return {.angle_rad = std::asin(std::clamp(sine, -1.0, 1.0)), .clamped = std::abs(sine) > 1.0};
}

Inclination inclination_from_field(const Eigen::Vector3d& field_in_sensor,
                                   double magnitude,
                                   const InclinationOptions& options) noexcept {
  const double side = options.convention == AxisConvention::forward_left_up ? 1.0 : -1.0;
  const double x = field_in_sensor.x();
  const double y = side * field_in_sensor.y() + 0.0;  // no -0
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
