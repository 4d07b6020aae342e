// SPDX-License-Identifier: Apache-2.0
// Pieces of pages. What comes from outside is escaped here and nowhere else.
#pragma once

#include <string>
#include <string_view>
#include <utility>
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

/// @return the number alone, rounded.
std::string rounded(double value, int digits = 2);

/// @param title, text  as they are to be read; they are escaped here.
/// @param content      of pieces that are escaped; without any there is no section.
std::string section(const std::string& id, const std::string& title, const std::string& content);
std::string paragraph(const std::string& text);

/// A list of at most 100; of more it says how many are left out.
std::string bullets(const std::vector<std::string>& lines);

/// Names and what they are, in two columns; those of nothing are left out.
std::string facts(const std::vector<std::pair<std::string, std::string>>& rows);

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
