// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// A foot that is a ball. A ball of radius 0 is the contact point of a foot of any shape.
struct AXISCAL_EXPORT Ball {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< position relative to the cube's centre
  double radius_m = 0.0;
};

/// The three feet of a face.
using Feet = std::array<Ball, 3>;

/// The feet of all faces, in the order of Face.
using CubeFeet = std::array<Feet, all_faces.size()>;

/// The plane on which a face stands: the points p with normal . p = offset_m, frame positioner.
struct AXISCAL_EXPORT ContactPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< outward unit normal, frame positioner
  double offset_m = 0.0;                              ///< distance from the cube's centre
};

/// Checks the feet of a face.
///
/// @return "" if they are valid, else the reason: a number is not finite; a radius is negative; the
///         balls overlap; the feet are in a line; no plane touches all three; the normal of that
///         plane is more than 0.2 rad from the face's nominal normal; or the plane is on the wrong
///         side of the cube's centre.
[[nodiscard]] AXISCAL_EXPORT std::string defect_of_feet(Face face, const Feet& feet);

/// Computes the plane that is tangent to the three balls on the outer side of the face: n . c_i +
/// r_i = d, with the centres c_i, the radii r_i, the normal n and the offset d.
///
/// The differences c_1 - c_3 and c_2 - c_3 give two equations for n. The third is |n| = 1. The
/// result is exact even if the radii differ.
/// @throws DomainError  if the feet have a defect_of_feet().
/// @par Source
/// method.md, section 9.
[[nodiscard]] AXISCAL_EXPORT ContactPlane contact_plane(Face face, const Feet& feet);

/// The dimensions of a cube with ball feet; all its faces are alike.
///
/// On the face +Z a foot position is (x, y), on +X (y, z), on +Y (z, x): the coordinates along the
/// next two axes in the cycle X, Y, Z, X. Opposite faces are mirror images. In the default layout
/// the middle of each face is inside the triangle of its feet, so that the cube never rocks.
struct BallFrame {
  double edge_m = 0.07;  ///< distance between opposite faces, without their feet
  std::array<Eigen::Vector2d, 3> foot_positions_m = {Eigen::Vector2d(0.027, 0.027),
                                                     Eigen::Vector2d(-0.027, 0.009),
                                                     Eigen::Vector2d(0.009, -0.027)};
  double foot_height_m = 0.004;  ///< distance from the face to the outermost point of a ball
  double ball_radius_m = 0.003;
};

/// Computes the feet of all faces from the dimensions.
///
/// @return three balls for each face, in the order of Face.
/// @throws DomainError  if the edge is not positive, a height or radius is negative, a foot is not
///                      on its face, or the feet have a defect_of_feet().
[[nodiscard]] AXISCAL_EXPORT CubeFeet feet_of_frame(const BallFrame& frame);

/// Describes feet of any shape by their contact points.
///
/// @return balls of radius 0. They are checked only when a Positioner is made of them.
/// @param points  three points for each face, in the order of Face [m], frame positioner.
[[nodiscard]] AXISCAL_EXPORT CubeFeet
feet_from_points(const std::array<std::array<Eigen::Vector3d, 3>, all_faces.size()>& points);

/// @return the three feet, rotated as one rigid body about the mean of their centres.
[[nodiscard]] AXISCAL_EXPORT Feet feet_rotated(const Feet& feet, const Eigen::Matrix3d& rotation);

/// @param normal  outward unit normal, frame positioner.
/// @return the three feet, rotated as one rigid body about the mean of their centres, so that their
///         contact plane has the given normal.
/// @throws DomainError  if the feet have a defect_of_feet(), or `normal` is opposite to the normal
///                      of their contact plane.
[[nodiscard]] AXISCAL_EXPORT Feet feet_turned_to(Face face,
                                                 const Feet& feet,
                                                 const Eigen::Vector3d& normal);

}  // namespace axiscal
