// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return true if all entries of |R^T R - I| are at most `tolerance`, and det R > 0.
[[nodiscard]] AXISCAL_EXPORT bool is_rotation(const Eigen::Matrix3d& R, double tolerance = 1e-9);

/// @return the cross-product matrix of v. Its product with any vector u is v cross u.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// @param rotation_rad  axis times angle [rad]; zero gives the identity.
/// @return the rotation by this angle about this axis.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_by(const Eigen::Vector3d& rotation_rad);

/// Finds the rotation R that is nearest to a matrix M: R minimizes the Frobenius norm |R - M|. If
/// M = sum a_i b_i^T, R also minimizes sum |a_i - R b_i|^2 (Procrustes).
///
/// @param M  any matrix of rank 2 or more.
/// @par Source
/// Kabsch, Acta Cryst. A 32 (1976) 922: R = U diag(1, 1, det(U V^T)) V^T.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M);

/// Returns the smallest rotation that takes the direction of `from` to the direction of `to`.
///
/// @param from  any non-zero vector, any frame.
/// @param to    any non-zero vector in the same frame; not opposite to `from`.
/// @return R, 3 x 3. Its axis is the cross product of `from` and `to`.
/// @throws DomainError  if a vector is zero or not finite, or the two are opposite.
/// @par Source
/// Rodrigues' formula with cos and sin taken from the dot and cross products.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d smallest_rotation(const Eigen::Vector3d& from,
                                                               const Eigen::Vector3d& to);

/// Returns the rotation from the local horizon (east, north, up) to the frame of a level table
/// (method.md, section 2).
///
/// @param fence_azimuth_rad  azimuth of the table's y axis, clockwise from north [rad].
/// @return rotation_table_from_enu, 3 x 3; the identity if the y axis points north.
/// @throws DomainError  if the azimuth is not finite.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_table_from_enu(double fence_azimuth_rad);

/// Returns the rotation from the frame of a level table to the frame of the same table with a
/// slope. It is the smallest rotation that takes (0, 0, 1) to (x, y, sqrt(1 - x^2 - y^2)).
///
/// @param slope  (x, y): the components of a vertical unit vector along the sloping table's x and y
///               axes. For small angles they are the slope in radians.
/// @throws DomainError  unless x^2 + y^2 < 1.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_sloping_from_level(
    const Eigen::Vector2d& slope);

/// Returns two unit vectors that are perpendicular to a direction and to each other.
///
/// @param direction  any non-zero vector.
/// @return 3 x 2; its columns and the direction, in this order, are right-handed.
/// @throws DomainError  if the direction is zero or not finite.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix<double, 3, 2> tangents_of(
    const Eigen::Vector3d& direction);

/// Returns directions that are spread evenly over the sphere, along a spiral.
///
/// @param count  number of directions, at least 1.
/// @par Source
/// Vogel's spiral: equal steps in z, the golden angle between neighbours.
[[nodiscard]] AXISCAL_EXPORT std::vector<Eigen::Vector3d> directions_on_sphere(int count);

}  // namespace axiscal
