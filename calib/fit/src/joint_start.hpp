// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Where [1, vec R_i] has rank 10, M_k = S_k^T f^T follows linearly, and f is the first right
/// singular vector of all of them below each other.
///
/// A sum of a local and an induced part has the columns [1, vec R_i, level_i vec R_i], of rank 19.
///
/// @param rows  the readings to use.
/// @return of all parts together a unit vector, its sign open; empty where the rank is less.
[[nodiscard]] Eigen::VectorXd linear_directions(const ReadingSet& set,
                                                const std::vector<Eigen::Index>& rows);

/// The starting points: the linear solution; otherwise the given direction; otherwise directions
/// all around.
/// @return one start or several, each with all the field's vectors.
[[nodiscard]] std::vector<TableField> start_fields(const ReadingSet& set);

}  // namespace axiscal
