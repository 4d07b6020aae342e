// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/reading_set.hpp"

namespace axiscal {

/// How the instrument sits in the cube otherwise in each mount, S_j = S (I + [d_j]x), the d_j of
/// sum 0: one step of a fit in which they are free beside all else.
struct MountStep {
  std::map<int, Eigen::Vector3d> turns;  ///< d_j [rad], by the mount's number
  double expected =
      0.0;  ///< mean square of a component of d_j that the readings' noise alone makes
};

/// @param set  with the turns that are known already in its rotations.
/// @return nothing for one mount, or where the readings of the mounts do not tell.
[[nodiscard]] std::optional<MountStep> step_of_mounts(const ReadingSet& set,
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
