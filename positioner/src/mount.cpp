// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/mount.hpp"

#include <set>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "core/formatted.hpp"

namespace axiscal {

std::vector<Mount> h_shaped_mounts(const std::string& first,
                                   const std::string& second,
                                   WebAxis axis) {
  const Eigen::Vector3d turned =
      axis == WebAxis::x ? Eigen::Vector3d(1.0, -1.0, -1.0) : Eigen::Vector3d(-1.0, 1.0, -1.0);
  return {{.slot = first},
          {.slot = second, .rotation_sensor_from_positioner = turned.asDiagonal()}};
}

std::vector<Mount> parallel_mounts(const std::vector<std::string>& slots) {
  std::vector<Mount> mounts;
  mounts.reserve(slots.size());
  for (const std::string& slot : slots) {
    mounts.push_back({.slot = slot});
  }
  return mounts;
}

std::vector<Mount> checked_mounts(std::vector<Mount> mounts) {
  std::set<std::string> names;
  for (Mount& mount : mounts) {
    if (mount.slot.empty() || !names.insert(mount.slot).second) {
      throw DomainError("each mount must have a different slot name, which is not empty");
    }
    if (!is_rotation(mount.rotation_sensor_from_positioner, 1e-6)) {
      throw DomainError(
          formatted("slot {}: rotation_sensor_from_positioner is not a rotation", mount.slot));
    }
    if (!(mount.repeatability_rad >= 0.0)) {
      throw DomainError(formatted("slot {}: the repeatability must not be negative", mount.slot));
    }
    // A matrix that is a rotation to within rounding errors is not changed.
    if (!is_rotation(mount.rotation_sensor_from_positioner, 1e-15)) {
      mount.rotation_sensor_from_positioner =
          nearest_rotation(mount.rotation_sensor_from_positioner);
    }
  }
  return mounts;
}

}  // namespace axiscal
