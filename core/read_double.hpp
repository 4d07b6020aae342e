// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>

namespace axiscal {

/// Reads a double by std::from_chars(), or by read_double_by_c_library() if the standard library
/// lacks that function (libc++ 14).
[[nodiscard]] std::from_chars_result read_double(const char* first,
                                                 const char* last,
                                                 double& value) noexcept;

/// Reads a double like read_double(), by the C library's strtod_l(). For decimal numbers the result
/// equals that of std::from_chars(): it is correctly rounded and does not depend on the locale.
/// `inf` and `nan` are rejected.
[[nodiscard]] std::from_chars_result read_double_by_c_library(const char* first,
                                                              const char* last,
                                                              double& value) noexcept;

}  // namespace axiscal
