// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The errors of a run's readings in addition to white noise (docs/method/worlds.md). An entry of 0
/// has no effect. If all entries are 0, the noise is white and normal.
struct AXISCAL_EXPORT World {
  double block_sd = 0.0;  ///< scatter of the bias from block to block, each axis [unit]
  double seat_rad = 0.0;  ///< turn of the cube each time it is laid, about x, y and z each [rad]
  double mount_rad =
      0.0;  ///< turn of the instrument in the cube in each block, about x, y and z each [rad]
  /// Turn as with mount_rad, but the readings do not state different mounts [rad].
  double remount_rad = 0.0;
  double gain = 0.0;    ///< scatter of each axis's sensitivities from block to block, relative
  double jitter = 0.0;  ///< scatter of the field's magnitude from reading to reading, relative
  /// Scatter as with jitter, but with a correlation of 0.9 between consecutive readings.
  double wander = 0.0;
  /// Noise with the field along an axis, divided by the noise with the field perpendicular to it;
  /// 0: both are equal.
  double ends = 0.0;
  double periodic = 0.0;  ///< amplitude of a disturbance that repeats every 7.3 readings [unit]
  double ar = 0.0;        ///< correlation of the noise of consecutive readings, in -1 .. 1
  double ar_white = 0.0;  ///< standard deviation of additional white noise [unit]
  /// Standard deviation of the step of the bias's random walk from reading to reading [unit].
  double walk_sd = 0.0;
  double drift = 0.0;  ///< change of the bias over the run, linear in reading order [unit]
  double round = 0.0;  ///< readings are rounded to multiples of this step [unit]
  int tails = 0;       ///< degrees of freedom of Student's noise, 3 or more; 0: normal
  /// The effect of the squared (k2) and the cubed (k3) field along an axis, at full field [unit]:
  /// one number for all axes, or one number for each axis. If empty, the effect is 0.
  std::vector<double> k2;
  std::vector<double> k3;
  /// True if errors of the face normals, the slope, the field's direction and its magnitude are
  /// drawn from their stated uncertainties.
  bool stated = false;

  /// @return true if noise is white and normal, and all other entries are off.
  [[nodiscard]] bool is_white() const;
};

/// @return the names of all entries of a world: "block_sd, seat_rad, ...".
[[nodiscard]] AXISCAL_EXPORT std::string world_names();

/// @return the world that the text `NAME=VALUE,...` states. If a value has one number for each
///         axis, the numbers are separated by colons.
/// @throws DomainError  if a name is unknown or a value is invalid.
[[nodiscard]] AXISCAL_EXPORT World world_of(std::string_view text);

/// Reads a world file (formats.md, World). @throws DataError
[[nodiscard]] AXISCAL_EXPORT World read_world(const std::string& path);

/// @return the world as `NAME=VALUE,...`, as world_of() takes it; empty for white noise.
[[nodiscard]] AXISCAL_EXPORT std::string world_text(const World& world);

}  // namespace axiscal
