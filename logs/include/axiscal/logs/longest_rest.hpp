// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "axiscal/logs/recording_file.hpp"

namespace axiscal {

/// A column of a log in which rest and motion show.
struct RestColumn {
  std::span<const double> samples;
  SeriesKind kind = SeriesKind::other;
  double si = 0.0;  ///< times this a sample is in m/s^2 or rad/s; 0 if the unit is not known
};

/// The longest part of a log that is at rest.
struct LongestRest {
  std::size_t first = 0;
  std::size_t end = 0;  ///< one behind its last sample
  bool moves = false;   ///< true if even this part is not a rest: the instrument moves all the time
};

/// Finds the longest part of a log at rest: windows of half a second whose variance is not many
/// times that of the quietest tenth, in every column. Ends that a hand moved are left out by one
/// window more.
///
/// A walk or a ride lacks quiet windows for comparison. There the means of neighbouring windows
/// differ more than those of any sensor at rest (0.05 m/s^2, 0.3 deg/s).
/// @param columns  of one length.
/// @param rate_hz  samples a second.
[[nodiscard]] LongestRest longest_rest(const std::vector<RestColumn>& columns, double rate_hz);

}  // namespace axiscal
