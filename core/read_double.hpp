// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>

namespace axiscal {

/// std::from_chars for a double, or where the standard library has none (libc++ 14) what
/// follows.
[[nodiscard]] std::from_chars_result read_double(const char* first,
                                                 const char* last,
                                                 double& value) noexcept;

/// The same by the C library: what from_chars gives for decimal numbers, correctly rounded and in
/// no one's locale; `inf` and `nan` are no numbers here.
[[nodiscard]] std::from_chars_result read_double_by_c_library(const char* first,
                                                              const char* last,
                                                              double& value) noexcept;

}  // namespace axiscal
