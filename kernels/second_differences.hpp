// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace axiscal {

/// Computes the sum over i = first .. first + count - 1 of (x[i + 2m] - 2 x[i + m] + x[i])^2, for
/// the overlapping Allan variance.
///
/// @param x      at least first + count + 2m entries.
/// @return the sum. Its last digits depend on the instruction set.
[[nodiscard]] double sum_of_squared_second_differences(std::span<const double> x,
                                                       std::size_t m,
                                                       std::size_t first,
                                                       std::size_t count);

/// Plain version of sum_of_squared_second_differences(), as a reference for tests.
[[nodiscard]] double sum_of_squared_second_differences_plain(std::span<const double> x,
                                                             std::size_t m,
                                                             std::size_t first,
                                                             std::size_t count);

}  // namespace axiscal
