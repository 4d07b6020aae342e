// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/positioner.hpp"

#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"

namespace axiscal {

std::string defect_of_normal(Face face, const Eigen::Vector3d& normal) {
  constexpr double largest_tilt_rad = 0.2;
  if (!(std::abs(normal.norm() - 1.0) <= 1e-6)) {
    return "must have unit length to 1e-6";
  }
  if (!(normal.dot(nominal_normal(face)) >= std::cos(largest_tilt_rad))) {
    return "is more than 0.2 rad from the nominal direction " + std::string(face_name(face)) +
           ": are faces mixed up, or the axes left-handed?";
  }
  return "";
}

Positioner::Positioner() : nominal_(true) {
  for (const Face face : all_faces) {
    normals_[static_cast<std::size_t>(face)] = nominal_normal(face);
  }
}

// NOLINTNEXTLINE(modernize-pass-by-value): an array of fixed vectors gains nothing by a move
Positioner::Positioner(const std::array<Eigen::Vector3d, 6>& normals, std::string id)
    : normals_(normals), id_(std::move(id)), nominal_(false) {
  for (const Face face : all_faces) {
    const std::string defect = defect_of_normal(face, normal(face));
    if (!defect.empty()) {
      throw DomainError("Positioner: the normal of face " + std::string(face_name(face)) + " " +
                        defect);
    }
    normals_[static_cast<std::size_t>(face)].normalize();
  }
}

Eigen::Matrix3d Positioner::rotation_table_from_positioner(const DesignPoint& point) const {
  const Eigen::Vector3d z = -normal(point.rest());
  const Eigen::Vector3d& fence = normal(point.fence());
  const Eigen::Vector3d y = (fence - fence.dot(z) * z).normalized();
  Eigen::Matrix3d R;
  R.row(0) = y.cross(z);
  R.row(1) = y;
  R.row(2) = z;
  return R.array() + 0.0;  // no -0
}

}  // namespace axiscal
