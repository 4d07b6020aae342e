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
  double si = 0.0;  ///< factor that converts samples to m/s^2 or rad/s; 0 if the unit is not known
};

/// The longest part of a log that is at rest.
struct LongestRest {
  std::size_t first = 0;  ///< index of the first sample
  std::size_t end = 0;    ///< one past the index of the last sample
  bool moves = false;     ///< true if the instrument moves even in this part
};

/// Finds the longest part of a log at rest. The log is divided into windows of about half a second.
/// A window is at rest if its variance in every column is at most a factor times the column's
/// variance at rest. The variance at rest is the 10 % quantile of the windows' variances, or the
/// 2 % quantile if less than a tenth of the log is at rest. The factor is between 8 and 40. It is
/// larger for a column whose variances differ more. At each end that borders on motion, the part is
/// shortened by one window, because a hand may already have touched the instrument there.
///
/// A log of a walk or a ride contains no window at rest. LongestRest::moves is true in two cases:
/// - The means of neighbouring windows differ by more than is usual at rest (0.05 m/s^2 or
///   0.3 deg/s).
/// - The part is shorter than 10 s and shorter than half of the log.
/// @param columns  columns of equal length.
/// @param rate_hz  samples per second.
[[nodiscard]] LongestRest longest_rest(const std::vector<RestColumn>& columns, double rate_hz);

}  // namespace axiscal
