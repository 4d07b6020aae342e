// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// Reads a complete text as one finite number; '.' is the decimal point, independent of the locale.
///
/// @param text  e.g. "1.5", "+2e-3", without blanks before or after the number.
/// @return the nearest double, or nullopt if the text is not a finite number.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_number(std::string_view text) noexcept;

/// Reads a complete text as one whole number in the range of int, like parse_number().
[[nodiscard]] AXISCAL_EXPORT std::optional<int> parse_integer(std::string_view text) noexcept;

/// Reads numbers that are separated by commas, e.g. "0.001,-0.002". Blanks around a number are
/// allowed.
///
/// @return the numbers, or nullopt if one of them is not a finite number.
[[nodiscard]] AXISCAL_EXPORT std::optional<std::vector<double>> parse_numbers(
    std::string_view text);

/// The largest number of characters that write_number() and write_decimals() write.
inline constexpr std::size_t number_text_size = 32;

/// Writes the shortest text that reads back to the same double, as std::to_chars() does; -0 is
/// written as 0. It uses Dragonbox (Jeon 2020, in fmt) and takes three quarters of the time of
/// std::to_chars(). Numbers with more than 7 digits before the point are written by
/// std::to_chars().
///
/// @param first  a buffer of at least number_text_size characters.
/// @param value  a finite number.
/// @return one past the last character written.
AXISCAL_EXPORT char* write_number(char* first, double value) noexcept;

/// Writes a number with a fixed number of decimals, several times as fast as write_number(); -0 is
/// written as 0.
///
/// The value is multiplied by a power of ten and then rounded. If the product is halfway between
/// two integers, to within its rounding error, either integer may be written. If the product is
/// 9e15 or more, the text is that of write_number().
///
/// @param first     a buffer of at least number_text_size characters.
/// @param value     a finite number.
/// @param decimals  number of digits after the decimal point, 0 to 15.
/// @return one past the last character written.
AXISCAL_EXPORT char* write_decimals(char* first, double value, int decimals) noexcept;

/// @return the shortest text that reads back to the same double.
[[nodiscard]] AXISCAL_EXPORT std::string number_text(double value);

/// @return the value with `digits` significant digits, as printf's %g, independent of the locale.
[[nodiscard]] AXISCAL_EXPORT std::string number_text(double value, int digits);

/// @return the unit of a ratio: "V/g", "V/(m/s^2)"; only `unit` if `other` is "1".
[[nodiscard]] AXISCAL_EXPORT std::string unit_per(const std::string& unit,
                                                  const std::string& other);

/// @return `text` without blanks and tabs at both ends.
[[nodiscard]] AXISCAL_EXPORT std::string_view trimmed(std::string_view text) noexcept;

/// @return `line` without the carriage returns at both ends, because some programs write "\r\r\n"
///         or "\n\r" at the end of a line.
[[nodiscard]] AXISCAL_EXPORT std::string_view without_returns(std::string_view line) noexcept;

/// @return the parts of `text` between the separators, trimmed; one part if there is no separator.
[[nodiscard]] AXISCAL_EXPORT std::vector<std::string_view> split(std::string_view text,
                                                                 char separator);

/// @return the parts joined to one text, with `separator` between them.
[[nodiscard]] AXISCAL_EXPORT std::string joined(const std::vector<std::string>& parts,
                                                std::string_view separator = ", ");

}  // namespace axiscal
