// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#ifdef __has_feature
#define AXISCAL_HAS_FEATURE(name) __has_feature(name)
#else
#define AXISCAL_HAS_FEATURE(name) 0
#endif

namespace axiscal::test {

/// True if the address sanitizer, which allocates memory too, is active.
#if defined(__SANITIZE_ADDRESS__) || AXISCAL_HAS_FEATURE(address_sanitizer)
inline constexpr bool under_address_sanitizer = true;
#else
inline constexpr bool under_address_sanitizer = false;
#endif

/// @return the number of calls of `operator new` in this program. Programs that link this file have
/// a counting `operator new`.
[[nodiscard]] std::size_t allocation_count();

/// @return the size of the largest allocation [bytes] since forget_largest_allocation().
[[nodiscard]] std::size_t largest_allocation();
void forget_largest_allocation();

}  // namespace axiscal::test
