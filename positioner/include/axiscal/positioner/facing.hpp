// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// @param direction_in_positioner  any vector except 0.
/// @return the face of the nominal cube whose outward normal is nearest to the direction.
[[nodiscard]] AXISCAL_EXPORT Face nearest_face(const Eigen::Vector3d& direction_in_positioner);

/// @return the face whose outward normal is nearest to a direction in the table's frame, for the
///         nominal cube at a design point.
[[nodiscard]] AXISCAL_EXPORT Face face_towards(const DesignPoint& point,
                                               const Eigen::Vector3d& direction_in_table);

}  // namespace axiscal
