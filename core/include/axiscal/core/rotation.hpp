// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return whether `R` is orthogonal to `tolerance` (largest entry of R^T R - 1) and det R > 0.
[[nodiscard]] AXISCAL_EXPORT bool is_rotation(const Eigen::Matrix3d& R, double tolerance = 1e-9);

/// @return [v x]: the matrix that makes the cross product, [v x] u = v x u.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// @param rotation_rad  axis times angle [rad]; zero gives 1.
/// @return the rotation about this vector.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_by(const Eigen::Vector3d& rotation_rad);

/// The nearest rotation to a matrix: the R that makes |R - M| least, and sum |a_i - R b_i|^2 for
/// M = sum a_i b_i^T (Procrustes).
///
/// @param M  any matrix of rank 2 or more.
/// @par Source
/// Kabsch, Acta Cryst. A 32 (1976) 922: R = U diag(1, 1, det(U V^T)) V^T.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M);

/// The smallest rotation that takes one direction to another: `to = R from`, both normalised.
///
/// @param from  any non-zero vector, any frame.
/// @param to    any non-zero vector in the same frame; not opposite to `from`.
/// @return R, 3 x 3; the axis is from x to, so that nothing turns about the direction itself.
/// @throws DomainError  if a vector is zero or not finite, or the two are opposite.
/// @par Source
/// Rodrigues' formula with cos and sin taken from the dot and cross products.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d smallest_rotation(const Eigen::Vector3d& from,
                                                               const Eigen::Vector3d& to);

/// Rotation from the local horizon to a level table whose fence lies at an azimuth (method.md,
/// section 2).
///
/// @param fence_azimuth_rad  azimuth of the table's y axis, clockwise from north [rad].
/// @return rotation_table_from_enu; 1 with the fence to the north.
/// @throws DomainError  if the azimuth is not finite.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_table_from_enu(double fence_azimuth_rad);

/// The rotation of directions in the table's frame by a slope. The normal of the level table
/// becomes (x, y, sqrt(1 - x^2 - y^2)), by the smallest rotation.
///
/// @param slope  the field's part along the table's x and y, for gravity the table's slope [rad].
/// @throws DomainError  unless x^2 + y^2 < 1.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_sloping_from_level(
    const Eigen::Vector2d& slope);

/// Two unit vectors square to a direction and to each other: the tangents in which it can change.
///
/// @param direction  any non-zero vector.
/// @return 3 x 2; its columns and the direction, in this order, are right-handed.
/// @throws DomainError  if the direction is zero or not finite.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix<double, 3, 2> tangents_of(
    const Eigen::Vector3d& direction);

/// Directions spread evenly over the sphere, along a spiral.
///
/// @param count  how many, at least 1.
/// @par Source
/// Vogel's spiral: equal steps in z, the golden angle between neighbours.
[[nodiscard]] AXISCAL_EXPORT std::vector<Eigen::Vector3d> directions_on_sphere(int count);

}  // namespace axiscal
