// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "calib/fit/reading_set.hpp"

namespace axiscal {

// The linear system of a fit of the response v = b + g S f with the temperature scale g. The rows
// are the readings, axis after axis. The first columns are those of the p own coefficients of each
// axis. The columns of the shared unknowns follow: the directions of the fields, and the errors of
// inputs or the coefficients of a hypothesis.

/// Derivative of the field in the sensor's frame with respect to q unknowns: (3 n) x q, with three
/// rows for each reading.
using FieldChanges = Eigen::MatrixXd;

/// @param axis  the axis; the derivatives are 0 for parts of the field to which it does not
///              respond.
/// @return derivatives of the field in the sensor's frame with respect to small rotations [rad] of
///         the field's vectors along their tangents, in the order of the vectors.
[[nodiscard]] FieldChanges field_direction_derivatives(
    const ReadingSet& set,
    const TableField& field,
    const std::vector<TableField::Tangents>& tangents,
    Eigen::Index axis = 0);

/// @return derivative of an axis's readings with respect to the unknowns of `changes`, without
///         weights; n x q.
/// @param S  the row of the sensitivity matrix for this axis.
[[nodiscard]] Eigen::MatrixXd response_changes(const ReadingSet& set,
                                               Eigen::Index axis,
                                               const Eigen::RowVector3d& S,
                                               const FieldChanges& changes);

/// @param own     for each axis: the derivatives with respect to its own coefficients, n x p.
/// @param shared  for each axis: the derivatives with respect to the shared unknowns, n x q.
/// @return the matrix of the linear system, (n m) x (p m + q).
[[nodiscard]] Eigen::MatrixXd stacked_by_axis(const std::vector<Eigen::MatrixXd>& own,
                                              const std::vector<Eigen::MatrixXd>& shared);

}  // namespace axiscal
