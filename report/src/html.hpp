// SPDX-License-Identifier: Apache-2.0
// Pieces of pages. What comes from outside is escaped here and nowhere else.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal {

/// @return text as it is shown: no tag, no entity, no attribute's end comes out of it.
std::string escaped(std::string_view text);

/// A table's cell: what is shown, and the number behind it for copying; `value` empty: as shown.
struct Cell {
  std::string text;
  std::string value;
};

/// @return a number to so many digits, with all of them behind it; "-" for NaN.
Cell number_cell(double value, int digits = 5);

/// Tables have so many rows; those of more are folded, a page of so many each.
inline constexpr std::size_t rows_of_page = 200;

/// A table that can be copied, of rows that are written already ("<tr>...").
/// @param caption  may be empty.
std::string paged_table(std::string_view caption,
                        const std::vector<std::string>& head,
                        const std::vector<std::string>& rows);

/// A table that can be copied.
/// @param caption  may be empty.
std::string html_table(std::string_view caption,
                       const std::vector<std::string>& head,
                       const std::vector<std::vector<Cell>>& rows);

}  // namespace axiscal
