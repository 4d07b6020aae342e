// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/positioner/feet.hpp"

namespace axiscal {

/// The seat of a cube at a design point.
struct AXISCAL_EXPORT Seat {
  Eigen::Matrix3d rotation_table_from_positioner = Eigen::Matrix3d::Identity();
  std::array<int, 2> contacts = {-1, -1};  ///< feet of the fence face that touch; -1: not known
  double turn_rad = 0.0;  ///< about the table's normal, from where the face normals put the fence
  bool rocks = false;     ///< a middle foot stands out: the cube has a second stable seat
  std::string defect;     ///< why the cube cannot lie so; empty for a good seat
};

/// Slides and turns a cube that rests on the table until it meets the fence (method.md, section 9).
///
/// The rest plane is the table's. Seen from above the cube is pushed at its centre towards the
/// fence and may turn by theta about the table's normal: two feet i, j of the fence face touch,
///
///     cos(lean) (c_x sin(theta) + c_y cos(theta)) + c_z sin(lean) = r_j - r_i,   c = c_i - c_j,
///
/// the third is clear, and the centre lies between the two along the fence, else the push would
/// turn the cube on. Where two pairs are stable the push brings the centre as near to the fence as
/// it gets: the nearer seat is given, and said to rock.
///
/// @param rotation_table_from_positioner  how the cube lies by its face normals: the rest face's is
///                                        exact, the turn about the table's normal a start.
/// @param fence_feet   feet of the fence face, frame positioner.
/// @param lean_rad     the fence leans over the table by this; its normal is (0, cos, sin).
/// @return the seat; `defect` says so where no pair is stable within 0.3 rad of the start.
/// @par Source
/// method.md, section 9.
[[nodiscard]] AXISCAL_EXPORT Seat seat_at_fence(
    const Eigen::Matrix3d& rotation_table_from_positioner, const Feet& fence_feet, double lean_rad);

}  // namespace axiscal
