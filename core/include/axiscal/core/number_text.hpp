// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// Reads a whole text as one finite number; '.' is the decimal point whatever the locale.
///
/// @param text  e.g. "1.5", "+2e-3", without blanks before or after the number.
/// @return the nearest double, or nullopt if the text is not a finite number.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_number(std::string_view text) noexcept;

/// As parse_number(), for whole numbers that an int holds.
[[nodiscard]] AXISCAL_EXPORT std::optional<int> parse_integer(std::string_view text) noexcept;

/// Numbers separated by commas: "0.001,-0.002"; blanks around a number are allowed.
///
/// @return the numbers, or nullopt if one of them is not a finite number.
[[nodiscard]] AXISCAL_EXPORT std::optional<std::vector<double>> parse_numbers(
    std::string_view text);

/// Room that write_number() needs at most.
inline constexpr std::size_t number_text_size = 32;

/// Writes the shortest text that reads back to the same double, as std::to_chars() does; -0 is
/// written as 0. By Dragonbox (Jeon 2020, in fmt), in three quarters of its time, but for numbers
/// with many digits before the point.
///
/// @param first  room for at least number_text_size characters.
/// @param value  a finite number.
/// @return one past the last character written.
AXISCAL_EXPORT char* write_number(char* first, double value) noexcept;

/// Writes so many decimals, several times as fast; -0 is written as 0.
///
/// Rounded as the product with a power of ten is: where a number lies half way between two texts,
/// to within its own rounding, it may be either. From 9e15 units of the last decimal on it is
/// write_number()'s text.
///
/// @param first     room for at least number_text_size characters.
/// @param value     a finite number.
/// @param decimals  0 to 15.
/// @return one past the last character written.
AXISCAL_EXPORT char* write_decimals(char* first, double value, int decimals) noexcept;

/// @return the shortest text that reads back to the same double.
[[nodiscard]] AXISCAL_EXPORT std::string number_text(double value);

/// @return the value to so many significant digits, as printf's %g, whatever the locale.
[[nodiscard]] AXISCAL_EXPORT std::string number_text(double value, int digits);

/// @return the unit of a ratio: "V/g", "V/(m/s^2)"; the first alone where the second is "1".
[[nodiscard]] AXISCAL_EXPORT std::string unit_per(const std::string& unit,
                                                  const std::string& other);

/// @return `text` without blanks and tabs at both ends.
[[nodiscard]] AXISCAL_EXPORT std::string_view trimmed(std::string_view text) noexcept;

/// @return `line` without the carriage returns at both ends: programs write "\r\n", "\r\r\n" and
///         "\n\r".
[[nodiscard]] AXISCAL_EXPORT std::string_view without_returns(std::string_view line) noexcept;

/// @return the parts of `text` between the separators, trimmed; one part where there is none.
[[nodiscard]] AXISCAL_EXPORT std::vector<std::string_view> split(std::string_view text,
                                                                 char separator);

/// @return the parts in one line, with `separator` between them.
[[nodiscard]] AXISCAL_EXPORT std::string joined(const std::vector<std::string>& parts,
                                                std::string_view separator = ", ");

}  // namespace axiscal
