// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/reading_set.hpp"

namespace axiscal {

/// The turns of the instrument in its mounts, S_j = S (I + [d_j]x) with d_j that sum to 0.
struct MountTurns {
  std::map<int, Eigen::Matrix3d> turns;  ///< by the mount's number
  double expected = 0.0;  ///< mean square of a component of d_j for the readings' noise alone
};

/// Fits the turns together with all other unknowns.
///
/// @param set  with the turns that are known already in its rotations.
/// @return `nullopt` for one mount, or if the readings do not determine the turns.
[[nodiscard]] std::optional<MountTurns> fitted_mounts(const ReadingSet& set,
                                                      const Estimate& estimate,
                                                      bool known_field);

/// What the mounts' scatter leaves of how S is turned, as a component "mounts" of the covariance
/// with 3 (B - 1) degrees of freedom; those of the turns that were fitted are taken from the
/// residuals'.
///
/// @param turns     in all, by the mount's number.
/// @param expected  as of the last step.
/// @return false where the turns leave no degrees of freedom, so that nothing was counted.
/// @par Source
/// method.md, section 4.
[[nodiscard]] bool add_mount_scatter(const std::map<int, Eigen::Matrix3d>& turns,
                                     double expected,
                                     Estimate& estimate);

}  // namespace axiscal
