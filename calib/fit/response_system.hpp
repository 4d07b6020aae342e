// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "calib/fit/reading_set.hpp"

namespace axiscal {

// The linear system behind every fit of a response v = b + scale S f: rows are the readings, axis
// after axis; columns each axis's own p coefficients, then what the axes share: the directions of
// the fields, and the errors of inputs or the columns of a hypothesis.

/// Derivative of the field in the sensor with respect to q unknowns: three rows for each reading,
/// (3 n) x q.
using FieldChanges = Eigen::MatrixXd;

/// @param axis  that sees the field; where axes see different parts of it what one does not see
///              changes nothing.
/// @return derivative with respect to a step along the tangents of the field [rad]; the vectors are
///         in order.
[[nodiscard]] FieldChanges field_direction_derivatives(
    const ReadingSet& set,
    const TableField& field,
    const std::vector<TableField::Tangents>& tangents,
    Eigen::Index axis = 0);

/// @return derivative of an axis's readings with respect to the same unknowns, without weights; n x
///         q.
/// @param S  the axis's row of the sensitivity.
[[nodiscard]] Eigen::MatrixXd response_changes(const ReadingSet& set,
                                               Eigen::Index axis,
                                               const Eigen::RowVector3d& S,
                                               const FieldChanges& changes);

/// @param own     of each axis n x p.
/// @param shared  of each axis n x q.
/// @return (n m) x (p m + q).
[[nodiscard]] Eigen::MatrixXd stacked_by_axis(const std::vector<Eigen::MatrixXd>& own,
                                              const std::vector<Eigen::MatrixXd>& shared);

}  // namespace axiscal
