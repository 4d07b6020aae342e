// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/feet.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Feet count as being in a line if the height of their triangle, divided by its longest side, is
// less than this.
constexpr double flattest_triangle = 0.02;

bool is_finite(const Ball& ball) {
  return ball.centre_m.allFinite() && std::isfinite(ball.radius_m);
}

// Returns the plane that touches all three balls on the side of `outward`, or nullopt.
std::optional<ContactPlane> tangent_plane(const Feet& feet, const Eigen::Vector3d& outward) {
  const Eigen::Vector3d a = feet[0].centre_m - feet[2].centre_m;
  const Eigen::Vector3d b = feet[1].centre_m - feet[2].centre_m;
  const Eigen::Vector3d across = a.cross(b).normalized();
  // The normal is n = p + h across. The vector p is parallel to the plane through the centres, and
  // solves the two linear equations for n.
  Eigen::Matrix3d rows;
  rows << a.transpose(), b.transpose(), across.transpose();
  const Eigen::Vector3d p = rows.partialPivLu().solve(Eigen::Vector3d(
      feet[2].radius_m - feet[0].radius_m, feet[2].radius_m - feet[1].radius_m, 0.0));
  const double rest = 1.0 - p.squaredNorm();
  if (!(rest > 0.0)) {
    return std::nullopt;
  }
  const Eigen::Vector3d n = p + std::copysign(std::sqrt(rest), across.dot(outward)) * across;
  return ContactPlane{.normal = n.normalized(),
                      .offset_m = n.normalized().dot(feet[0].centre_m) + feet[0].radius_m};
}

}  // namespace

std::string defect_of_feet(Face face, const Feet& feet) {
  for (const Ball& ball : feet) {
    if (!is_finite(ball)) {
      return "must have finite centres and radii";
    }
    if (ball.radius_m < 0.0) {
      return "must have radii that are not negative";
    }
  }
  double longest = 0.0;
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const Ball& one = feet[i];
    const Ball& other = feet[(i + 1) % feet.size()];
    const double distance = (one.centre_m - other.centre_m).norm();
    longest = std::max(longest, distance);
    if (!(distance > 0.0) || distance < one.radius_m + other.radius_m) {
      return "overlap: the distance of two balls is less than the sum of their radii";
    }
  }
  const Eigen::Vector3d a = feet[0].centre_m - feet[2].centre_m;
  const Eigen::Vector3d b = feet[1].centre_m - feet[2].centre_m;
  if (!(a.cross(b).norm() > flattest_triangle * longest * longest)) {
    return "are in a line, so the face cannot stand on them; move one foot to the side";
  }
  const std::optional<ContactPlane> plane = tangent_plane(feet, nominal_normal(face));
  if (!plane) {
    return "have no plane that touches all three: their radii differ by more than their distance";
  }
  if (!(plane->offset_m > 0.0)) {
    return "are on the wrong side of the cube's centre: are faces mixed up?";
  }
  const std::string defect = defect_of_normal(face, plane->normal);
  return defect.empty() ? "" : "stand on a plane whose normal " + defect;
}

ContactPlane contact_plane(Face face, const Feet& feet) {
  if (const std::string defect = defect_of_feet(face, feet); !defect.empty()) {
    throw DomainError(formatted("the feet of face {} {}", face_name(face), defect));
  }
  return *tangent_plane(feet, nominal_normal(face));
}

CubeFeet feet_of_frame(const BallFrame& frame) {
  if (!(frame.edge_m > 0.0) || !(frame.foot_height_m >= 0.0) || !(frame.ball_radius_m >= 0.0)) {
    throw DomainError(
        "feet_of_frame: the edge must be positive, foot height and ball radius not negative");
  }
  for (const Eigen::Vector2d& position : frame.foot_positions_m) {
    if (!(position.cwiseAbs().maxCoeff() <= 0.5 * frame.edge_m)) {
      throw DomainError("feet_of_frame: a foot must stand on its face, within half of the edge");
    }
  }
  CubeFeet cube;
  for (const Face face : all_faces) {
    const Eigen::Vector3d along = Eigen::Vector3d::Unit((axis_of(face) + 1) % 3);
    const Eigen::Vector3d across = Eigen::Vector3d::Unit((axis_of(face) + 2) % 3);
    const double reach_m = 0.5 * frame.edge_m + frame.foot_height_m - frame.ball_radius_m;
    Feet& feet = cube[static_cast<std::size_t>(face)];
    for (std::size_t i = 0; i < feet.size(); ++i) {
      const Eigen::Vector2d& position = frame.foot_positions_m[i];
      feet[i] = Ball{
          .centre_m = reach_m * nominal_normal(face) + position.x() * along + position.y() * across,
          .radius_m = frame.ball_radius_m};
    }
    static_cast<void>(contact_plane(face, feet));  // throws if the feet have a defect
  }
  return cube;
}

CubeFeet feet_from_points(
    const std::array<std::array<Eigen::Vector3d, 3>, all_faces.size()>& points) {
  CubeFeet cube;
  for (std::size_t face = 0; face < points.size(); ++face) {
    for (std::size_t i = 0; i < 3; ++i) {
      cube[face][i] = Ball{.centre_m = points[face][i], .radius_m = 0.0};
    }
  }
  return cube;
}

Feet feet_rotated(const Feet& feet, const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d middle = (feet[0].centre_m + feet[1].centre_m + feet[2].centre_m) / 3.0;
  Feet turned = feet;
  for (Ball& ball : turned) {
    ball.centre_m = middle + rotation * (ball.centre_m - middle);
  }
  return turned;
}

Feet feet_turned_to(Face face, const Feet& feet, const Eigen::Vector3d& normal) {
  return feet_rotated(feet, smallest_rotation(contact_plane(face, feet).normal, normal));
}

}  // namespace axiscal
