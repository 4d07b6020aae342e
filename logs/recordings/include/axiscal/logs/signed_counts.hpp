// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace axiscal {

/// Columns of signed counts that were printed unsigned: 65404 for -132.
struct SignedCounts {
  int bits = 0;                      ///< 12 to 32; 0: there are none
  std::vector<std::size_t> columns;  ///< whose values are signed; in some of them none is negative
};

/// Looks for signed counts that were printed unsigned: whole numbers of 0 to 2^bits - 1, small and
/// large ones, and hardly any in between, in two columns or more.
/// @param samples  columns of one length.
/// @param fewest_bits  16 unless they are known to be an accelerometer's, gyroscope's or
/// magnetometer's:
///                     light that is on or off looks the same in 12 bits.
[[nodiscard]] SignedCounts find_signed_counts(const std::vector<std::span<const double>>& samples,
                                              int fewest_bits = 16);

/// @return the count with its sign: 65404 of 16 bits is -132.
[[nodiscard]] double with_sign(double count, int bits);

/// @param names  of all columns.
/// @return a note about the change.
[[nodiscard]] std::string words_of(const SignedCounts& counts,
                                   const std::vector<std::string>& names);

}  // namespace axiscal
