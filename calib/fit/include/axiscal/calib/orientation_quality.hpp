// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/core/units.hpp"

namespace axiscal {

/// calibrate() adds a warning if OrientationQuality::largest_gap_rad is larger than this limit,
/// because the fit extrapolates in the gap.
inline constexpr double largest_good_gap_rad = 60.0 * rad_per_deg;

/// Computes how well the orientations of calibrated readings cover the sphere, and how much the
/// magnitudes of the readings differ from the field's magnitude.
///
/// @param fields     calibrated readings in the sensor's frame, n x 3 [any unit]; n at least 1.
/// @param magnitude  F, the magnitude of the field [unit of `fields`].
/// @throws DomainError  if there are no readings, or if they do not have three components.
[[nodiscard]] AXISCAL_EXPORT OrientationQuality orientation_quality(const Eigen::MatrixXd& fields,
                                                                    double magnitude);

/// @return the direction in words, for example "+x" or "-x +z": the axes along which the unit
///         vector has a component larger than 0.38 in absolute value.
[[nodiscard]] AXISCAL_EXPORT std::string direction_in_words(const Eigen::Vector3d& direction);

/// Aligns two three-axis instruments, using the constant angle between the fields they measure.
///
/// For an accelerometer and a magnetometer, for example, this angle is the same in every
/// orientation, because it depends only on the dip of the geomagnetic field. The constant angle
/// determines the rotation between the two instruments, but not their rotation in the vehicle. The
/// accuracy of the rotation does not depend on the dip, but the error of a heading computed with it
/// is proportional to 1 / cos(dip). A Gauss-Newton search starts from each of the 24 rotations that
/// exchange or reverse axes.
///
/// @param fields     calibrated readings of the first instrument, n x 3, n at least 5.
/// @param companion  calibrated readings of the second instrument at the same times, n x 3.
/// @throws DomainError   if the sizes differ or are too small.
/// @throws RefusedError  if the orientations do not determine the rotation.
/// @par Source
/// method.md, section 4.
[[nodiscard]] AXISCAL_EXPORT Alignment align_by_constant_angle(const Eigen::MatrixXd& fields,
                                                               const Eigen::MatrixXd& companion);

}  // namespace axiscal
