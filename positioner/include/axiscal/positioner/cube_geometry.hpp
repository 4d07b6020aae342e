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
  double angle_rad = 0.0;      ///< 0 .. pi
  double deviation_rad = 0.0;  ///< angle_rad minus pi/2 (neighbours) or minus pi (opposites)
};

/// The deviation of a cube from the nominal cube. It does not depend on the choice of the
/// positioner's axes.
struct CubeGeometry {
  std::vector<FaceAngle> angles;  ///< one for each of the 15 pairs of faces
  /// Distance of each face's contact plane from the centre [m]; nullopt without feet.
  std::array<std::optional<double>, all_faces.size()> offset_m;
  double worst_from_square_rad = 0.0;
  double worst_from_parallel_rad = 0.0;
};

/// @par Source
/// method.md, section 9.
[[nodiscard]] AXISCAL_EXPORT CubeGeometry describe_geometry(const Positioner& positioner);

}  // namespace axiscal
