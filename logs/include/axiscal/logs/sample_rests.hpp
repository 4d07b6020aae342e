// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "axiscal/calib/observations.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// Raw samples as readings: each rest's mean is one reading.
struct SampleRests {
  Observations readings;  ///< one for each rest, with `samples`, `response_sd` and the middle time
  std::vector<std::size_t> rows;  ///< number of the sample in the middle of each rest
  std::size_t samples = 0;        ///< number of samples in the rests
  /// True if each block is one rest, for example one file per face. The readings then form one
  /// block.
  bool one_each_block = false;
};

/// Looks for rests among readings that may be raw samples: many samples in each orientation instead
/// of one reading. The rests are found by segment(); no rest spans two blocks.
///
/// @param samples  readings without poses, in the order in which they were taken.
/// @return nullopt if the readings are not raw samples: there are fewer than 30, less than 30 % of
///         them are in rests, or rests have fewer than 3 samples on average.
[[nodiscard]] std::optional<SampleRests> rests_of_samples(const Observations& samples);

/// Finds the faces on which a cube rested from the gravity in its readings.
/// @param readings  readings of an accelerometer with three axes.
/// @return the faces that resting_faces() finds; empty if gravity has more than 8 directions that
///         differ by 10 degrees or more, so that the instrument did not lie on faces of a cube.
/// @throws RefusedError  for the reasons of resting_faces().
[[nodiscard]] std::vector<std::optional<Face>> faces_by_gravity(const Observations& readings);

}  // namespace axiscal
