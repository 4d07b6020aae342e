// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/facing.hpp"

#include <algorithm>

#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

Face nearest_face(const Eigen::Vector3d& direction_in_positioner) {
  return *std::max_element(all_faces.begin(), all_faces.end(), [&](Face a, Face b) {
    return nominal_normal(a).dot(direction_in_positioner) <
           nominal_normal(b).dot(direction_in_positioner);
  });
}

Face face_towards(const DesignPoint& point, const Eigen::Vector3d& direction_in_table) {
  static const Positioner cube;
  return nearest_face(cube.rotation_table_from_positioner(point).transpose() * direction_in_table);
}

}  // namespace axiscal
