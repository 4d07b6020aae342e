// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/cube_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace axiscal {

CubeGeometry describe_geometry(const Positioner& positioner) {
  CubeGeometry geometry;
  for (const Face first : all_faces) {
    if (const std::optional<Feet>& feet = positioner.feet(first)) {
      const Ball& ball = feet->front();
      geometry.offset_m[static_cast<std::size_t>(first)] =
          positioner.normal(first).dot(ball.centre_m) + ball.radius_m;
    }
    for (const Face second : all_faces) {
      if (first >= second) {
        continue;
      }
      const Eigen::Vector3d& a = positioner.normal(first);
      const Eigen::Vector3d& b = positioner.normal(second);
      const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
      const bool is_opposite = second == opposite(first);
      const double nominal = is_opposite ? std::numbers::pi : 0.5 * std::numbers::pi;
      geometry.angles.push_back(
          {.first = first, .second = second, .angle_rad = angle, .deviation_rad = angle - nominal});
      double& worst =
          is_opposite ? geometry.worst_from_parallel_rad : geometry.worst_from_square_rad;
      worst = std::max(worst, std::abs(angle - nominal));
    }
  }
  return geometry;
}

}  // namespace axiscal
