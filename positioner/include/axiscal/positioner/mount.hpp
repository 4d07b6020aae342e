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
  std::string slot;  ///< name of the slot, used in the names of columns: SLOT.axis
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();
  /// Standard deviation of the small rotation error of the instrument about each axis. The error
  /// changes each time the instrument is mounted.
  double repeatability_rad = 0.0;
};

/// The axis in the web of an H-shaped frame about which the second instrument is turned.
enum class WebAxis { x, y };

/// Makes the mounts of two instruments in an H-shaped frame, one on each side of its web ("mirror
/// images").
///
/// The web is perpendicular to the positioner's z. A mirror image is not a rotation, so an
/// instrument cannot be mounted as its own mirror image. Instead, the second instrument is turned
/// by 180 degrees about an axis in the web: the positioner's x, with the rotation diag(1, -1, -1),
/// or y, with diag(-1, 1, -1). With either axis, the second instrument's base is on the other side
/// of the web. The two orientations differ by 180 degrees about z.
///
/// @param first, second  the slots' names.
/// @return two mounts: the first has the cube's orientation, the second is turned.
/// @par Source
/// method.md, section 9; US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT std::vector<Mount> h_shaped_mounts(const std::string& first,
                                                                const std::string& second,
                                                                WebAxis axis = WebAxis::x);

/// @return one mount for each slot, all with the orientation of the cube.
[[nodiscard]] AXISCAL_EXPORT std::vector<Mount> parallel_mounts(
    const std::vector<std::string>& slots);

/// Checks mounts, and returns them. A matrix that is a rotation to within 1e-6, but not exactly, is
/// replaced with the nearest rotation.
///
/// @throws DomainError  if a slot's name is empty or repeated, a matrix is not a rotation (to
///                      1e-6), or a repeatability is negative.
[[nodiscard]] AXISCAL_EXPORT std::vector<Mount> checked_mounts(std::vector<Mount> mounts);

}  // namespace axiscal
