// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The mount of an instrument in the positioner: one slot of an assembly.
struct AXISCAL_EXPORT Mount {
  std::string slot;  ///< its name; columns of observations are called SLOT.axis
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();
  double repeatability_rad =
      0.0;  ///< standard deviation of a small rotation about each axis, each time it is mounted
};

/// The axis in the web of an H-shaped frame about which the second instrument is turned.
enum class WebAxis { x, y };

/// The two instruments of an H-shaped frame: on either side of its web, "mirror images".
///
/// The web is perpendicular to the positioner's z. A mirror image is not a rotation, so an
/// instrument cannot be mounted as its own mirror image. A rigid frame turns the second instrument
/// by 180 degrees about an axis in the web, here the positioner's x, diag(1, -1, -1), or y,
/// diag(-1, 1, -1). Both bring its base to the web from the other side; they differ by half a turn
/// about z.
///
/// @param first, second  the slots' names.
/// @return the first as the cube, the second turned.
/// @par Source
/// method.md, section 9; US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT std::vector<Mount> h_shaped_mounts(const std::string& first,
                                                                const std::string& second,
                                                                WebAxis axis = WebAxis::x);

/// Instruments in one orientation, that of the cube: single (one slot), triple (three), any number.
[[nodiscard]] AXISCAL_EXPORT std::vector<Mount> parallel_mounts(
    const std::vector<std::string>& slots);

/// Checks mounts, and makes matrices that were written with few digits rotations to the last digit.
///
/// @throws DomainError  if a slot's name is empty or repeated, a matrix is not a rotation (to
///                      1e-6), or a repeatability is negative.
[[nodiscard]] AXISCAL_EXPORT std::vector<Mount> checked_mounts(std::vector<Mount> mounts);

}  // namespace axiscal
