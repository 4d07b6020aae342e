// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/instrument.hpp"

namespace axiscal {

/// The formula for the pitch angle.
enum class PitchFormula {
  arcsine,     ///< asin(f_x / F): uses the field's magnitude; uncertainty grows as 1 / cos(pitch)
  arctangent,  ///< atan2(f_x, hypot(f_y, f_z)): needs no magnitude, equal accuracy at all angles
};

struct InclinationOptions {
  AxisConvention convention = AxisConvention::forward_left_up;
  PitchFormula pitch_formula = PitchFormula::arcsine;
  double yaw_above_rad = 85.0 * rad_per_deg;  ///< yaw replaces roll if |pitch| is at least this
};

/// Attitude of an instrument at rest that senses the specific force.
struct Inclination {
  double pitch_rad = 0.0;  ///< pitch angle, positive nose up, -pi/2 to pi/2
  double roll_rad = 0.0;   ///< roll angle, positive right side down, in (-pi, pi]; 0 if gives_yaw
  double yaw_rad = 0.0;    ///< yaw angle, in (-pi, pi]; 0 unless gives_yaw
  bool gives_yaw = false;  ///< true if yaw replaces roll because |pitch| is at least yaw_above_rad
  bool clamped = false;    ///< true if |f_x| was greater than F and was replaced by F
};

/// Computes pitch and roll from the field's components. If pitch is near +-90 degrees, it computes
/// yaw instead of roll. The formulas for forward-left-up are
///
///     pitch = asin(f_x / F)      roll = atan2(f_y, f_z)      yaw = atan2(f_y, f_x)
///
/// For forward-right-down, roll = atan2(-f_y, -f_z) and yaw = atan2(-f_y, f_x).
///
/// @param field_in_sensor  specific force at rest [any unit], finite.
/// @param magnitude        F, length of the specific force at the place of the readings [same
///                         unit], positive.
/// @return the angles, never NaN. If |f_x| exceeds F, the argument of asin is clamped and `clamped`
///         is true.
/// @par Source
/// US 7,467,536; method.md, section 7.
[[nodiscard]] AXISCAL_EXPORT Inclination
inclination_from_field(const Eigen::Vector3d& field_in_sensor,
                       double magnitude,
                       const InclinationOptions& options = {}) noexcept;

/// Computes the rotation of an instrument with a stated attitude, e.g. on a dividing head. The
/// instrument is first turned by the heading, then pitched nose up, then rolled right side down.
///
/// @param heading_rad  heading of the instrument's x axis, clockwise from the y axis of the level
///                     frame.
/// @return the rotation R from the level frame (z up) to the sensor's frame. For the specific
///         force R (0, 0, F), inclination_from_field() returns the given pitch and roll.
/// @par Source
/// method.md, section 7.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_sensor_from_level(double pitch_rad,
                                                                        double roll_rad,
                                                                        double heading_rad,
                                                                        AxisConvention convention);

/// The result of elevation_of_axis().
struct AxisElevation {
  double angle_rad = 0.0;  ///< angle of the axis above the horizontal, -pi/2 to pi/2
  bool clamped = false;    ///< true if |component| was greater than F and was replaced by F
};

/// Computes the angle of a sensing axis above the horizontal: asin(component / F).
///
/// @param component  the field's component along the axis [any unit], finite.
/// @param magnitude  the field's magnitude F [same unit], positive.
[[nodiscard]] AXISCAL_EXPORT AxisElevation elevation_of_axis(double component,
                                                             double magnitude) noexcept;

}  // namespace axiscal
