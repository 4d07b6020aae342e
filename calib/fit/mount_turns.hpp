// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// The rotations of the instrument in its mounts. The sensitivity in mount j is S_j = S (I +
/// [d_j]x), where [d_j]x is the cross-product matrix of the rotation vector d_j. The vectors d_j
/// sum to 0.
struct MountTurns {
  std::map<int, Eigen::Matrix3d> turns;  ///< rotation for each mount number
  /// Expected sum of the squared components of all d_j, divided by 3 (B - 1) for B mounts, if the
  /// rotations are only noise.
  double expected = 0.0;
};

/// Fits the rotations of the mounts together with all other unknowns.
///
/// @param set  the readings; their orientations already include the known rotations of mounts.
/// @return the rotations; `nullopt` if there is only one mount, or if the readings do not determine
///         the rotations.
[[nodiscard]] std::optional<MountTurns> fitted_mounts(const ReadingSet& set,
                                                      const Estimate& estimate,
                                                      bool known_field);

}  // namespace axiscal
