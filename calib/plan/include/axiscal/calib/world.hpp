// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The differences between a run and readings with white noise of one standard deviation
/// (method.md, section 8). An entry of 0 is off; if all are 0, noise is white and normal.
struct AXISCAL_EXPORT World {
  double block_sd = 0.0;  ///< scatter of the bias from block to block, each axis [unit]
  double seat_rad = 0.0;  ///< turn of the cube each time it is laid, about x, y and z each [rad]
  double mount_rad =
      0.0;  ///< turn of the instrument in the cube in each block, about x, y and z each [rad]
  double remount_rad = 0.0;  ///< the same, of mounts that nobody wrote down [rad]
  double gain = 0.0;         ///< scatter of each axis's sensitivities from block to block, relative
  double jitter = 0.0;       ///< scatter of the field's size from reading to reading, relative
  double wander = 0.0;    ///< the same, slow: correlated by 0.9 with the reading before, relative
  double ends = 0.0;      ///< noise at full field along an axis over that across it; 0: the same
  double periodic = 0.0;  ///< amplitude of a disturbance that repeats every 7.3 readings [unit]
  double ar = 0.0;        ///< correlation of a reading's noise with the one before, in -1 .. 1
  double ar_white = 0.0;  ///< white noise besides [unit]
  double walk_sd = 0.0;   ///< step of the bias from reading to reading, a random walk [unit]
  double drift = 0.0;     ///< change of the bias over the run, linear in its order [unit]
  double round = 0.0;     ///< readings are rounded to multiples of it [unit]
  int tails = 0;          ///< degrees of freedom of Student's noise, 3 or more; 0: normal
  /// The effect of the squared or cubed field along an axis at full field, as one number for all
  /// axes or one for each [unit]; empty: none.
  std::vector<double> k2;
  std::vector<double> k3;
  bool stated = false;  ///< stated uncertainties are drawn: face normals, slope, direction, F

  /// @return true if noise is white and normal, and all other entries are off.
  [[nodiscard]] bool is_white() const;
};

/// @return the names of all that a world may have, "block_sd, seat_rad, ...".
[[nodiscard]] AXISCAL_EXPORT std::string world_names();

/// @return the world of `NAME=VALUE,...`; numbers of single axes are joined by colons.
/// @throws DomainError  for a name or value that is none.
[[nodiscard]] AXISCAL_EXPORT World world_of(std::string_view text);

/// Reads a world (formats.md, World). @throws DataError
[[nodiscard]] AXISCAL_EXPORT World read_world(const std::string& path);

/// @return the world as `NAME=VALUE,...`, as world_of() takes it; empty for white noise.
[[nodiscard]] AXISCAL_EXPORT std::string world_text(const World& world);

}  // namespace axiscal
