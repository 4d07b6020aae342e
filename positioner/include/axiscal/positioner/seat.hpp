// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/positioner/feet.hpp"

namespace axiscal {

/// The seat of a cube at a design point: its orientation, and the feet that touch the fence.
struct AXISCAL_EXPORT Seat {
  Eigen::Matrix3d rotation_table_from_positioner = Eigen::Matrix3d::Identity();
  std::array<int, 2> contacts = {-1, -1};  ///< indices of the feet that touch the fence, or -1
  /// Angle about the table's normal by which the cube is turned from the orientation that its face
  /// normals alone give.
  double turn_rad = 0.0;
  bool rocks = false;  ///< true if the middle foot protrudes, so that a second seat is also stable
  std::string defect;  ///< why the cube cannot lie at this design point; empty for a valid seat
};

/// Slides and turns a cube that rests on the table until it touches the fence (method.md, section
/// 9).
///
/// The cube is pushed at its centre towards the fence. It may turn by theta about the table's
/// normal. A seat is stable if two feet i, j of the fence face touch the fence,
///
///     cos(lean) (c_x sin(theta) + c_y cos(theta)) + c_z sin(lean) = r_j - r_i,   c = c_i - c_j,
///
/// the third foot does not reach the fence, and the cube's centre is between the feet i and j along
/// the fence. (If it were not, the push would turn the cube further.) Here c_i and r_i are the
/// centre and radius of foot i. If two pairs of feet are stable, the seat whose centre is nearer to
/// the fence is returned, and its `rocks` is true.
///
/// @param rotation_table_from_positioner  the cube's orientation, computed from its face normals.
///                                        The turn theta starts from this orientation.
/// @param fence_feet   feet of the fence face, frame positioner.
/// @param lean_rad     angle by which the fence leans over the table. The direction towards the
///                     fence is (0, cos(lean), sin(lean)), frame table.
/// @return the seat; `defect` is not empty if no pair is stable within 0.3 rad of the start.
/// @par Source
/// method.md, section 9.
[[nodiscard]] AXISCAL_EXPORT Seat seat_at_fence(
    const Eigen::Matrix3d& rotation_table_from_positioner, const Feet& fence_feet, double lean_rad);

}  // namespace axiscal
