// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

namespace axiscal {

/// @param line  without its end.
/// @return the line without the checksum that devices put behind a star, as in "12.5*68".
[[nodiscard]] std::string_view without_checksum(std::string_view line);

/// @param line       without its end.
/// @param delimiter  between the cells; a blank stands for any run of blanks and tabs.
/// @return the cells of a line of text, without surrounding blanks. Text between quotes is one
///         cell.
[[nodiscard]] std::vector<std::string_view> cells_of(std::string_view line, char delimiter);

/// @param cell           may stand in quotes.
/// @param decimal_comma  whether a comma is the decimal point.
/// @return the number; NaN if the text is not a finite number.
[[nodiscard]] double cell_number(std::string_view cell, bool decimal_comma);

/// @return true if a cell stands for a missing number: empty, nan, null, none, n/a, -, ? and
///         similar.
[[nodiscard]] bool is_missing(std::string_view cell);

/// A number with the usual additions of handwriting, such as a unit.
struct DressedNumber {
  double value;           ///< NaN if the cell is no such number
  std::string_view unit;  ///< behind it, as "g" of "0.34 g"; may be empty
  bool is_grouped;        ///< its thousands are parted, as in "15,267"
};

/// Reads "0.34 g", "15,267", "15'267.5 m/s^2": a number with a unit behind it or parted thousands.
/// @param cell           may stand in quotes.
/// @param decimal_comma  whether a comma is the decimal point; points then part thousands.
[[nodiscard]] DressedNumber dressed_number(std::string_view cell, bool decimal_comma);

/// @return a column's name, without quotes and blanks around it.
[[nodiscard]] std::string_view cell_name(std::string_view cell);

/// @return true if a line is empty or a comment by `#` or `%`.
[[nodiscard]] bool is_comment_line(std::string_view line);

}  // namespace axiscal
