// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#ifdef __has_feature
#define AXISCAL_HAS_FEATURE(name) __has_feature(name)
#else
#define AXISCAL_HAS_FEATURE(name) 0
#endif

namespace axiscal::test {

/// The address sanitizer takes memory of its own.
#if defined(__SANITIZE_ADDRESS__) || AXISCAL_HAS_FEATURE(address_sanitizer)
inline constexpr bool under_address_sanitizer = true;
#else
inline constexpr bool under_address_sanitizer = false;
#endif

/// @return how often `operator new` has been called in this program; a program that asks for it has
///         its `operator new` replaced by a counting one.
[[nodiscard]] std::size_t allocation_count();

/// @return the largest single piece of memory [bytes] since forget_largest_allocation().
[[nodiscard]] std::size_t largest_allocation();
void forget_largest_allocation();

}  // namespace axiscal::test
