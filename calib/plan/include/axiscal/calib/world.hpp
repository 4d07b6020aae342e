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
  /// Standard deviation of the cube's random rotation about each of x, y and z, each time it is
  /// placed on the table [rad].
  double seat_rad = 0.0;
  /// Standard deviation of the instrument's random rotation in the cube, about each of x, y and z;
  /// it is different in each block [rad].
  double mount_rad = 0.0;
  /// Like mount_rad, but the readings do not state that the instrument was mounted again [rad].
  double remount_rad = 0.0;
  double gain = 0.0;    ///< scatter of each axis's sensitivities from block to block, relative
  double jitter = 0.0;  ///< scatter of the field's magnitude from reading to reading, relative
  /// Like jitter, but with a correlation of 0.9 between consecutive readings.
  double wander = 0.0;
  /// Noise of an axis if the field is along the axis, divided by its noise if the field is
  /// perpendicular. 0 has the effect of 1: the noise does not depend on the field.
  double ends = 0.0;
  double periodic = 0.0;  ///< amplitude of a disturbance that repeats every 7.3 readings [unit]
  double ar = 0.0;        ///< correlation of the noise of consecutive readings, in -1 .. 1
  double ar_white = 0.0;  ///< standard deviation of additional white noise [unit]
  /// Standard deviation of the step of the bias's random walk from reading to reading [unit].
  double walk_sd = 0.0;
  double drift = 0.0;  ///< change of the bias over the run, linear in reading order [unit]
  double round = 0.0;  ///< readings are rounded to multiples of this step [unit]
  /// Degrees of freedom of noise with Student's distribution, 3 or more; 0: normal noise.
  int tails = 0;
  /// Response to the squared (k2) and the cubed (k3) field component along an axis, if the full
  /// field is along the axis [unit]. Each has one number for all axes or one number for each axis.
  /// An empty vector means that there is no such response.
  std::vector<double> k2;
  std::vector<double> k3;
  /// True if errors of the face normals, the slope, the field's direction and its magnitude are
  /// drawn from their stated uncertainties.
  bool stated = false;

  /// @return true if all entries are 0, so that the only error is white, normal noise.
  [[nodiscard]] bool is_white() const;
};

/// @return the names of all members of World: "block_sd, seat_rad, ...".
[[nodiscard]] AXISCAL_EXPORT std::string world_names();

/// Parses the members of a World from the text `NAME=VALUE,...`. If a value has one number for each
/// axis, the numbers are separated by colons.
/// @throws DomainError  if a name is unknown or a value is invalid.
[[nodiscard]] AXISCAL_EXPORT World world_of(std::string_view text);

/// Reads a World from a file (formats.md, World). @throws DataError
[[nodiscard]] AXISCAL_EXPORT World read_world(const std::string& path);

/// @return the text `NAME=VALUE,...` from which world_of() gives the same World; empty if all
///         entries are 0.
[[nodiscard]] AXISCAL_EXPORT std::string world_text(const World& world);

}  // namespace axiscal
