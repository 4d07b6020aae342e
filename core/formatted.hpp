// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#if __has_include(<fmt/base.h>)
#include <fmt/base.h>
#else
#include <fmt/core.h>
#endif

namespace axiscal {

/// Implements formatted(). It is not inline, so that files with this header do not compile all of
/// fmt.
[[nodiscard]] std::string formatted_all(fmt::string_view text, fmt::format_args values);

/// Returns the text with each {} replaced by a value: `formatted("run {}: {}", run, why)`. The
/// format specifiers are those of fmt: {:.3g}, {:>8}, {{ for a brace.
///
/// Numbers are written as by fmt, independent of the locale. Use number_text() for a double that is
/// read again later.
template <typename... Values>
[[nodiscard]] std::string formatted(fmt::format_string<const Values&...> text,
                                    const Values&... values) {
  return formatted_all(text, fmt::make_format_args(values...));
}

/// Does the same as formatted() for a text that is known only at run time.
/// @throws fmt::format_error  if the placeholders do not match the values.
template <typename... Values>
[[nodiscard]] std::string formatted_by(std::string_view text, const Values&... values) {
  return formatted_all({text.data(), text.size()}, fmt::make_format_args(values...));
}

}  // namespace axiscal
