// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "axiscal/logs/recording_file.hpp"

namespace axiscal {

/// A column of a log that is used to detect rest and motion.
struct RestColumn {
  std::span<const double> samples;
  SeriesKind kind = SeriesKind::other;
  double si = 0.0;  ///< factor to m/s^2 or rad/s; 0 if the unit is not known
};

/// The longest part of a log that is at rest.
struct LongestRest {
  std::size_t first = 0;
  std::size_t end = 0;  ///< one past its last sample
  bool moves = false;   ///< true if even this part is not a rest: the instrument moves all the time
};

/// Finds the longest part of a log at rest. A window of half a second is at rest if its variance in
/// every column is at most 8 to 40 times the 10 % quantile of the column's variances. At each end
/// that borders on motion the outermost window is left out, because a hand may have moved the
/// instrument in it.
///
/// A log of a walk or a ride contains no quiet windows to compare with. It is recognised by the
/// means of neighbouring windows, which differ more than those of any sensor at rest (0.05 m/s^2,
/// 0.3 deg/s).
/// @param columns  columns of equal length.
/// @param rate_hz  samples per second.
[[nodiscard]] LongestRest longest_rest(const std::vector<RestColumn>& columns, double rate_hz);

}  // namespace axiscal
