// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/instrument.hpp"

namespace axiscal {

/// Which formula gives the pitch angle.
enum class PitchFormula {
  arcsine,     ///< asin(f_x / F): uses the field's magnitude; uncertainty grows as 1 / cos(pitch)
  arctangent,  ///< atan2(f_x, hypot(f_y, f_z)): needs no magnitude, equal accuracy everywhere
};

struct InclinationOptions {
  AxisConvention convention = AxisConvention::forward_left_up;
  PitchFormula pitch_formula = PitchFormula::arcsine;
  double yaw_above_rad = 85.0 * rad_per_deg;  ///< |pitch| from which yaw is given instead of roll
};

/// Attitude of an instrument that senses the specific force at rest.
struct Inclination {
  double pitch_rad = 0.0;  ///< nose up is positive, -pi/2 to pi/2
  double roll_rad = 0.0;   ///< right side down is positive, in (-pi, pi]; 0 where yaw is given
  double yaw_rad = 0.0;    ///< in (-pi, pi]; 0 where roll is given
  bool gives_yaw = false;  ///< yaw instead of roll, as |pitch| is at least yaw_above_rad
  bool clamped = false;    ///< |f_x| was above F and was taken as F
};

/// Pitch and roll, or near +-90 degrees of pitch pitch and yaw, from the field's components.
///
///     pitch = asin(f_x / F)      roll = atan2(f_y, f_z)      yaw = atan2(f_y, f_x)
///
/// in forward-left-up; in forward-right-down roll = atan2(-f_y, -f_z), yaw = atan2(-f_y, f_x).
///
/// @param field_in_sensor  specific force at rest [any unit], finite.
/// @param magnitude        F, its length where the readings were taken [the same unit], positive.
/// @return the angles; never NaN: asin's argument is clamped and that is flagged.
/// @par Source
/// US 7,467,536; method.md, section 7.
[[nodiscard]] AXISCAL_EXPORT Inclination
inclination_from_field(const Eigen::Vector3d& field_in_sensor,
                       double magnitude,
                       const InclinationOptions& options = {}) noexcept;

/// The orientation of an instrument with a stated attitude, as on a dividing head: turned by its
/// heading, then nose up by its pitch, then right side down by its roll.
///
/// @param heading_rad  of its x axis, clockwise from the y axis of the level frame.
/// @return the rotation to its frame from the level one, z up; inclination_from_field() gives the
///         same pitch and roll back.
/// @par Source
/// method.md, section 7.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_sensor_from_level(double pitch_rad,
                                                                        double roll_rad,
                                                                        double heading_rad,
                                                                        AxisConvention convention);

/// An angle and whether the arcsine's argument had to be clamped.
struct AxisElevation {
  double angle_rad = 0.0;  ///< angle of the axis above the horizontal, -pi/2 to pi/2
  bool clamped = false;
};

/// Angle of one sensing axis above the horizontal: asin(component / F).
///
/// @param component  the field along the axis [any unit], finite.
/// @param magnitude  F [the same unit], positive.
[[nodiscard]] AXISCAL_EXPORT AxisElevation elevation_of_axis(double component,
                                                             double magnitude) noexcept;

}  // namespace axiscal
