// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/core/units.hpp"

namespace axiscal {

/// The largest gap between orientations without a warning. In a larger gap the fit extrapolates.
inline constexpr double largest_good_gap_rad = 60.0 * rad_per_deg;

/// @param fields     calibrated readings, n x 3 [any unit], frame sensor; n at least 1.
/// @param magnitude  F [the same unit].
/// @throws DomainError  without readings.
[[nodiscard]] AXISCAL_EXPORT OrientationQuality orientation_quality(const Eigen::MatrixXd& fields,
                                                                    double magnitude);

/// @return a direction in words: "+x", "-x +z"; the axes along which its unit vector has a
///         component above 0.38.
[[nodiscard]] AXISCAL_EXPORT std::string direction_in_words(const Eigen::Vector3d& direction);

/// Aligns two three-axis instruments by the constancy of the angle between their fields.
///
/// In every orientation the angle between gravity and the geomagnetic field is the dip plus 90
/// degrees. This fixes the rotation between the two instruments, but not their rotation in the
/// vehicle. The dip does not affect the accuracy of the rotation. The heading error is proportional
/// to 1 / cos(dip).
///
/// @param fields     calibrated readings of the first instrument, n x 3, n at least 5.
/// @param companion  calibrated readings of the second instrument at the same times, n x 3.
/// @throws DomainError   if the sizes differ or are too small.
/// @throws RefusedError  if the orientations do not determine the rotation.
/// @par Source
/// method.md, section 4; Gauss-Newton from the 24 rotations of a cube.
[[nodiscard]] AXISCAL_EXPORT Alignment align_by_constant_angle(const Eigen::MatrixXd& fields,
                                                               const Eigen::MatrixXd& companion);

}  // namespace axiscal
