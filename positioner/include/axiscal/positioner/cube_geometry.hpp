// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "axiscal/core/export.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// Two faces of a cube and the angle between their outward normals.
struct FaceAngle {
  Face first = Face::plus_x;
  Face second = Face::plus_x;
  double angle_rad = 0.0;      ///< angle between the outward normals, 0 to pi
  double deviation_rad = 0.0;  ///< angle_rad minus pi/2 (adjacent faces) or pi (opposite faces)
};

/// The deviation of a cube from the nominal cube. It does not depend on how the axes of the
/// positioner's frame are chosen.
struct CubeGeometry {
  std::vector<FaceAngle> angles;  ///< one element for each of the 15 pairs of faces
  /// Distance of each face's contact plane from the cube's centre [m]; nullopt if the feet of the
  /// face are unknown.
  std::array<std::optional<double>, all_faces.size()> offset_m;
  double worst_from_square_rad = 0.0;    ///< largest |deviation_rad| of adjacent faces
  double worst_from_parallel_rad = 0.0;  ///< largest |deviation_rad| of opposite faces
};

/// Computes the angles between the faces of a cube, and the distance of each face from the cube's
/// centre.
/// @par Source
/// method.md, section 9.
[[nodiscard]] AXISCAL_EXPORT CubeGeometry describe_geometry(const Positioner& positioner);

}  // namespace axiscal
