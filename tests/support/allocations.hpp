// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace axiscal::test {

/// @return how often `operator new` has been called in this program; a program that asks for it has
///         its `operator new` replaced by a counting one.
[[nodiscard]] std::size_t allocation_count();

/// @return the largest single piece of memory [bytes] since forget_largest_allocation().
[[nodiscard]] std::size_t largest_allocation();
void forget_largest_allocation();

}  // namespace axiscal::test
