// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>

namespace axiscal {

/// std::from_chars for a double, or where the standard library has none (libc++ 14) what
/// follows.
[[nodiscard]] std::from_chars_result read_double(const char* first,
                                                 const char* last,
                                                 double& value) noexcept;

/// As read_double(), by the C library: the result of from_chars for decimal numbers, correctly
/// rounded and independent of the locale. `inf` and `nan` are rejected.
[[nodiscard]] std::from_chars_result read_double_by_c_library(const char* first,
                                                              const char* last,
                                                              double& value) noexcept;

}  // namespace axiscal
