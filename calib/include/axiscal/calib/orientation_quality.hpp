// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <Eigen/Core>

namespace axiscal {

/// How well orientations without labels cover the sphere, and how well the fit explains them: the
/// figures that users know from magneto and MotionCal.
struct OrientationQuality {
  double fit_error = 0.0;         ///< rms of |f| - F, relative to F
  double magnitude_spread = 0.0;  ///< standard deviation of |f|, relative to F
  double coverage = 0.0;          ///< share of the sphere that is within 30 degrees of a reading
  double largest_gap_rad = 0.0;   ///< from a direction that no reading is near to the nearest one
  Eigen::Vector3d gap = Eigen::Vector3d::UnitZ();  ///< that direction, frame sensor
};

/// @param fields     calibrated readings, n x 3 [any unit], frame sensor; n at least 1.
/// @param magnitude  F [the same unit].
/// @throws DomainError  without readings.
[[nodiscard]] OrientationQuality orientation_quality(const Eigen::MatrixXd& fields,
                                                     double magnitude);

/// @return a direction in words: "+x", "-x +z"; the axes that it points along by more than 0.38.
[[nodiscard]] std::string direction_in_words(const Eigen::Vector3d& direction);

/// How two instruments that were recorded together are turned against each other.
struct Alignment {
  Eigen::Matrix3d rotation_companion_from_sensor = Eigen::Matrix3d::Identity();
  Eigen::Vector3d standard_error_rad = Eigen::Vector3d::Zero();  ///< about x, y, z of the companion
  double angle_rad = 0.0;  ///< between the two fields; the dip is this less 90 degrees
  double angle_se_rad = 0.0;
  double residual_sd = 0.0;  ///< of the cosine of that angle
};

/// Aligns two three-axis instruments by the constancy of the angle between their fields.
///
/// Whatever the orientation, gravity and the geomagnetic field make one angle, the dip plus 90
/// degrees; that fixes the rotation between the two instruments, but not how they sit in anything
/// else. The rotation is as good at any dip (the heading that comes of it is not: it goes as 1 /
/// cos(dip)).
///
/// @param fields     calibrated readings of the one, n x 3, n at least 5.
/// @param companion  calibrated readings of the other at the same times, n x 3.
/// @throws DomainError   if the sizes differ or are too small.
/// @throws RefusedError  if the orientations do not determine the rotation.
/// @par Source
/// METHOD section 4; Gauss-Newton from the 24 rotations of a cube.
[[nodiscard]] Alignment align_by_constant_angle(const Eigen::MatrixXd& fields,
                                                const Eigen::MatrixXd& companion);

}  // namespace axiscal
