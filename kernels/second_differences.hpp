// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace axiscal {

/// sum over i = first .. first + count - 1 of (x[i + 2m] - 2 x[i + m] + x[i])^2, for the
/// overlapping Allan variance.
///
/// @param x      at least first + count + 2m entries.
/// @return the sum, by as many accumulators as the machine likes: its last digits depend on that.
[[nodiscard]] double sum_of_squared_second_differences(std::span<const double> x,
                                                       std::size_t m,
                                                       std::size_t first,
                                                       std::size_t count);

/// The same in plain code: the reference.
[[nodiscard]] double sum_of_squared_second_differences_plain(std::span<const double> x,
                                                             std::size_t m,
                                                             std::size_t first,
                                                             std::size_t count);

}  // namespace axiscal
