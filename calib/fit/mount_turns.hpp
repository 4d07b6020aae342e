// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// The rotations of the instrument in its mounts: S_j = S (I + [d_j]x) is the sensitivity in mount
/// j. The rotation vectors d_j sum to 0.
struct MountTurns {
  std::map<int, Eigen::Matrix3d> turns;  ///< rotation for each mount number
  double expected = 0.0;  ///< mean square of a component of d_j if only noise causes the turns
};

/// Fits the turns together with all other unknowns.
///
/// @param set  the readings; their rotations already include the turns that are known.
/// @return `nullopt` for one mount, or if the readings do not determine the turns.
[[nodiscard]] std::optional<MountTurns> fitted_mounts(const ReadingSet& set,
                                                      const Estimate& estimate,
                                                      bool known_field);

}  // namespace axiscal
