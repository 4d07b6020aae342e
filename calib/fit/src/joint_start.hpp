// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Computes the directions of the field's parts by linear regression.
///
/// Let R_i be the rotation from the table's frame to the sensor's frame at reading i, and vec R_i
/// its nine elements. If the rows [1, vec R_i] have rank 10, the regression gives the matrix M_k =
/// S_k^T f^T for each axis k. S_k is the row of the sensitivity matrix, and f the field in the
/// table's frame. The direction of f is the first right singular vector of the matrices M_k stacked
/// below each other.
///
/// For the sum of a local and an induced part, the columns are [1, vec R_i, level_i vec R_i], and
/// the rank is 19.
///
/// @param rows  the readings to use.
/// @return a unit vector that consists of the vectors of all parts, three components each, with
///         either sign; empty if the rank is lower.
[[nodiscard]] Eigen::VectorXd linear_directions(const ReadingSet& set,
                                                const std::vector<Eigen::Index>& rows);

/// Returns the starting points of the search. If the linear solution exists, it is the only one.
/// Otherwise a part of the field starts at its stated direction. A part without a stated direction
/// starts at directions over the whole sphere.
/// @return one start or several, each with all the field's vectors.
[[nodiscard]] std::vector<TableField> start_fields(const ReadingSet& set);

}  // namespace axiscal
