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
  double remount_rad = 0.0;  ///< as mount_rad, but the readings do not state the mounts [rad]
  double gain = 0.0;         ///< scatter of each axis's sensitivities from block to block, relative
  double jitter = 0.0;       ///< scatter of the field's size from reading to reading, relative
  double wander = 0.0;       ///< as jitter, with a correlation of 0.9 between consecutive readings
  double ends = 0.0;         ///< noise with the field along an axis / with it across; 0: equal
  double periodic = 0.0;     ///< amplitude of a disturbance that repeats every 7.3 readings [unit]
  double ar = 0.0;           ///< correlation of the noise of consecutive readings, in -1 .. 1
  double ar_white = 0.0;     ///< standard deviation of additional white noise [unit]
  double walk_sd = 0.0;      ///< step of the bias from reading to reading, a random walk [unit]
  double drift = 0.0;        ///< change of the bias over the run, linear in reading order [unit]
  double round = 0.0;        ///< readings are rounded to multiples of this step [unit]
  int tails = 0;             ///< degrees of freedom of Student's noise, 3 or more; 0: normal
  /// The effect of the squared (k2) and the cubed (k3) field along an axis, at full field [unit]:
  /// one number for all axes or one for each. If empty, the effect is 0.
  std::vector<double> k2;
  std::vector<double> k3;
  /// True if errors of the face normals, the slope, the field's direction and its magnitude are
  /// drawn
  /// from their stated uncertainties.
  bool stated = false;

  /// @return true if noise is white and normal, and all other entries are off.
  [[nodiscard]] bool is_white() const;
};

/// @return the names of all entries of a world: "block_sd, seat_rad, ...".
[[nodiscard]] AXISCAL_EXPORT std::string world_names();

/// @return the world of the text `NAME=VALUE,...`. Colons separate the numbers of the axes.
/// @throws DomainError  if a name is unknown or a value is invalid.
[[nodiscard]] AXISCAL_EXPORT World world_of(std::string_view text);

/// Reads a world (formats.md, World). @throws DataError
[[nodiscard]] AXISCAL_EXPORT World read_world(const std::string& path);

/// @return the world as `NAME=VALUE,...`, as world_of() takes it; empty for white noise.
[[nodiscard]] AXISCAL_EXPORT std::string world_text(const World& world);

}  // namespace axiscal
