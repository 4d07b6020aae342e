// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace axiscal {

/// Columns of signed integers that were printed as unsigned ones, such as 65404 for -132.
struct SignedCounts {
  int bits = 0;                      ///< width of the integers, 12 to 32; 0 if none were found
  std::vector<std::size_t> columns;  ///< columns of signed counts; some may have no negative values
};

/// Looks for columns of signed counts that were printed unsigned. Such a column contains only whole
/// numbers from 0 to 2^bits - 1, and at most 2 % of them are between 0.375 and 0.625 times 2^bits.
/// At least two of the columns must contain numbers both below and above this range.
/// @param samples  columns, all of the same length.
/// @param fewest_bits  smallest width of the integers to look for [bits]. A width below 16 is safe
///                     only for the columns of an accelerometer, a gyroscope or a magnetometer,
///                     because other columns may look like 12-bit counts, such as the readings of a
///                     light that is on or off.
[[nodiscard]] SignedCounts find_signed_counts(const std::vector<std::span<const double>>& samples,
                                              int fewest_bits = 16);

/// @return the signed count for a count that was printed unsigned: -132 for 65404 with 16 bits.
[[nodiscard]] double with_sign(double count, int bits);

/// @param names  names of all columns.
/// @return a note that states which columns are read as signed counts.
[[nodiscard]] std::string words_of(const SignedCounts& counts,
                                   const std::vector<std::string>& names);

}  // namespace axiscal
