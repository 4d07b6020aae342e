// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>

namespace axiscal {

/// Reads a double by std::from_chars(), or by read_double_by_c_library() if the standard library
/// lacks that function (libc++ 14).
[[nodiscard]] std::from_chars_result read_double(const char* first,
                                                 const char* last,
                                                 double& value) noexcept;

/// As read_double(), by the C library's strtod_l(). For decimal numbers it gives the result of
/// std::from_chars(): correctly rounded and independent of the locale. `inf` and `nan` are
/// rejected.
[[nodiscard]] std::from_chars_result read_double_by_c_library(const char* first,
                                                              const char* last,
                                                              double& value) noexcept;

}  // namespace axiscal
