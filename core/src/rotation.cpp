// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/rotation.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

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

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d K;
  // clang-format off
  K <<   0.0, -v.z(),  v.y(),
       v.z(),    0.0, -v.x(),
      -v.y(),  v.x(),    0.0;
  // clang-format on
  return K;
}

Eigen::Matrix3d rotation_by(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  return angle > 0.0 ? Eigen::AngleAxisd(angle, rotation_rad / angle).toRotationMatrix()
                     : Eigen::Matrix3d::Identity();
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs(2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

Eigen::Matrix3d smallest_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = checked_direction(from, "smallest_rotation");
  const Eigen::Vector3d b = checked_direction(to, "smallest_rotation");
  const double cosine = a.dot(b);
  if (!(cosine > -1.0 + 1e-12)) {
    throw DomainError(
        "smallest_rotation: the directions are opposite, so the smallest rotation is not unique");
  }
  const Eigen::Matrix3d K = cross_matrix(a.cross(b));
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

std::vector<Eigen::Vector3d> directions_on_sphere(int count) {
  if (count < 1) {
    throw DomainError("directions_on_sphere: at least one direction is needed");
  }
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(golden_angle * i), r * std::sin(golden_angle * i), z);
  }
  return directions;
}

}  // namespace axiscal
