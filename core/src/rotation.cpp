// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/rotation.hpp"

#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

Eigen::Vector3d checked_direction(const Eigen::Vector3d& vector, const char* function) {
  const double length = vector.norm();
  if (!(length > 0.0) || !std::isfinite(length)) {
    throw DomainError(std::string(function) + ": a direction must be finite and not zero");
  }
  return vector / length;
}

}  // namespace

bool is_rotation(const Eigen::Matrix3d& R, double tolerance) {
  const Eigen::Matrix3d defect = R.transpose() * R - Eigen::Matrix3d::Identity();
  return defect.cwiseAbs().maxCoeff() <= tolerance && R.determinant() > 0.0;
}

Eigen::Matrix3d smallest_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = checked_direction(from, "smallest_rotation");
  const Eigen::Vector3d b = checked_direction(to, "smallest_rotation");
  const double cosine = a.dot(b);
  if (!(cosine > -1.0 + 1e-12)) {
    throw DomainError("smallest_rotation: opposite directions have no smallest rotation");
  }
  const Eigen::Vector3d v = a.cross(b);
  Eigen::Matrix3d K;
  // clang-format off
  K <<   0.0, -v.z(),  v.y(),
       v.z(),    0.0, -v.x(),
      -v.y(),  v.x(),    0.0;
  // clang-format on
  return Eigen::Matrix3d::Identity() + K + K * K / (1.0 + cosine);
}

Eigen::Matrix3d rotation_table_from_enu(double fence_azimuth_rad) {
  if (!std::isfinite(fence_azimuth_rad)) {
    throw DomainError("rotation_table_from_enu: the azimuth must be finite");
  }
  const double c = std::cos(fence_azimuth_rad);
  const double s = std::sin(fence_azimuth_rad);
  Eigen::Matrix3d R;
  // clang-format off
  R << c,  -s,  0.0,
       s,   c,  0.0,
       0.0, 0.0, 1.0;
  // clang-format on
  return R;
}

Eigen::Matrix3d rotation_sloping_from_level(const Eigen::Vector2d& slope) {
  if (!(slope.squaredNorm() < 1.0)) {
    throw DomainError("the slope must satisfy X^2 + Y^2 < 1");
  }
  return smallest_rotation(Eigen::Vector3d::UnitZ(),
                           {slope.x(), slope.y(), std::sqrt(1.0 - slope.squaredNorm())});
}

Eigen::Matrix<double, 3, 2> tangents_of(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d u = checked_direction(direction, "tangents_of");
  Eigen::Index smallest = 0;
  u.cwiseAbs().minCoeff(&smallest);
  Eigen::Matrix<double, 3, 2> T;
  T.col(0) = u.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  T.col(1) = u.cross(T.col(0));
  return T;
}

}  // namespace axiscal
