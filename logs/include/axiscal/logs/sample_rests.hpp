// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/observations.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// Readings that were computed from raw samples: the mean of each rest is one reading.
struct SampleRests {
  Observations readings;  ///< one for each rest, with number of samples, standard deviation, time
  std::vector<std::size_t> rows;  ///< index of the sample in the middle of each rest
  std::size_t samples = 0;        ///< number of samples in the rests
  /// True if each block of samples is a single rest, for example if each face has its own file. The
  /// blocks are then merged into one.
  bool one_each_block = false;
  /// A sentence about samples at the start of each rest at which the readings have not settled;
  /// empty if there are none.
  std::string unsettled;
};

/// Finds the rests in readings that may be raw samples. Raw samples are many readings in each
/// orientation, instead of one mean. The rests are found by segment(). No rest spans two blocks.
///
/// @param samples  readings without poses, in the order in which they were taken.
/// @return nullopt if the readings are not raw samples. This is so if there are fewer than 30
///         readings, if less than 30 % of them are in rests, or if the rests have fewer than 3
///         samples on average.
[[nodiscard]] std::optional<SampleRests> rests_of_samples(const Observations& samples);

/// Finds the face on which a cube rested at each reading, from the measured gravity.
/// @param readings  readings of an accelerometer with three axes.
/// @return the faces that resting_faces() finds. The result is empty if gravity has more than 8
///         directions that differ by 10 degrees or more, because the instrument then did not lie on
///         faces of a cube.
/// @throws RefusedError  if resting_faces() throws it.
[[nodiscard]] std::vector<std::optional<Face>> faces_by_gravity(const Observations& readings);

}  // namespace axiscal
