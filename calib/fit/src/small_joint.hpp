// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/reading_set.hpp"

namespace axiscal {

/// Where the readings of a small run lead a field's direction and the axes' noise.
struct SmallJointSolution {
  Eigen::Vector3d field;  ///< in the table
  Eigen::Vector3d sigma;  ///< of each axis
};

/// The same iterations as of any run, axes alike first and then each by its own noise, by normal
/// equations of fixed sizes: what they come to is good to the last digits, as steps shrink to
/// nothing whatever they are made by.
/// @param set       as SmallState::can_be() has it.
/// @param smallest  of the sigma: what rounding leaves.
/// @return nothing where a step does not help, or the readings determine something only just, or
///         tell too little of the noise.
[[nodiscard]] std::optional<SmallJointSolution> solve_small_joint(const ReadingSet& set,
                                                                  const Eigen::Vector3d& start,
                                                                  const Eigen::Vector3d& smallest);

/// The direction that follows linearly, of [1, vec R_i], its sign open: where to start from.
/// @return nothing where the readings do not clearly determine it.
[[nodiscard]] std::optional<Eigen::Vector3d> small_linear_direction(const ReadingSet& set);

}  // namespace axiscal
