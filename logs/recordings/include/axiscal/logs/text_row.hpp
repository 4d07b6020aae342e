// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

namespace axiscal {

/// @param line  a line of text without its line end.
/// @return the line without the checksum that some devices append: "12.5*68" becomes "12.5".
[[nodiscard]] std::string_view without_checksum(std::string_view line);

/// @param line       a line of text without its line end.
/// @param delimiter  character between the cells; a blank stands for any run of blanks and tabs.
/// @return the cells of the line, without surrounding blanks. A delimiter between quotes does not
///         separate cells.
[[nodiscard]] std::vector<std::string_view> cells_of(std::string_view line, char delimiter);

/// @param cell           text of a cell, which may be enclosed in quotes.
/// @param decimal_comma  true if a comma is the decimal separator.
/// @return the number in the cell; NaN if the text is not a finite number.
[[nodiscard]] double cell_number(std::string_view cell, bool decimal_comma);

/// @return true if a cell stands for a missing number: empty, nan, null, none, n/a, -, ? and
///         similar.
[[nodiscard]] bool is_missing(std::string_view cell);

/// A number that is followed by a unit or contains thousands separators.
struct DecoratedNumber {
  double value;           ///< NaN if the cell does not contain such a number
  std::string_view unit;  ///< unit after the number, "g" in "0.34 g"; may be empty
  bool is_grouped;        ///< true if the number has thousands separators: "15,267"
};

/// Reads a number that is followed by a unit or contains thousands separators: "0.34 g", "15,267",
/// "15'267.5 m/s^2".
/// @param cell           text of a cell, which may be enclosed in quotes.
/// @param decimal_comma  true if a comma is the decimal separator; dots then separate thousands.
[[nodiscard]] DecoratedNumber parse_decorated_number(std::string_view cell, bool decimal_comma);

/// @return the text of a cell without the quotes and blanks around it.
[[nodiscard]] std::string_view cell_name(std::string_view cell);

/// @return true if a line is empty or begins with `#`, `%` or `//`.
[[nodiscard]] bool is_comment_line(std::string_view line);

}  // namespace axiscal
