// SPDX-License-Identifier: Apache-2.0
// Pieces of pages. What comes from outside is escaped here and nowhere else.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axiscal {

/// @return text for display in HTML: it cannot form tags, entities or the end of an attribute.
std::string escaped(std::string_view text);

/// @return text as a string of a style sheet, with quotes; it cannot end the string or the style
///         element.
std::string css_string(std::string_view text);

/// @return text with the true minus sign for the hyphen before a number.
std::string typographic_minus(std::string text);

/// @return a face's name with a true minus, which can be read from a distance.
std::string typographic_face(std::string_view name);

/// @return a coordinate of a drawing, to a tenth.
std::string svg_number(double value);

/// A table's cell: the displayed text, and the number for copying; `value` empty: the displayed
/// text.
struct Cell {
  std::string text;
  std::string value;
};

/// @return the value with the digits that its uncertainty allows; all digits in the data.
[[nodiscard]] Cell rounded_cell(double value, double uncertainty);

/// @return a number to so many digits, with all of them behind it; "-" for NaN.
Cell number_cell(double value, int digits = 5);

/// @return the number alone, rounded.
std::string rounded(double value, int digits = 2);

/// Values and their uncertainties as one column, "0.01196 ± 0.00027": rounded together and padded,
/// so that decimal points are aligned. NaN is a dash.
std::vector<Cell> quantity_cells(const std::vector<std::pair<double, double>>& quantities);

enum class Fold {
  never,
  open,
  closed,
};

/// @param title, text  as they are to be read; they are escaped here.
/// @param content      of escaped pieces; if empty, the section is left out.
std::string section(const std::string& id,
                    const std::string& title,
                    const std::string& content,
                    Fold fold = Fold::never);
std::string paragraph(const std::string& text);

/// A list of at most 100; of more it says how many are left out.
std::string bullets(const std::vector<std::string>& lines);

/// Names and their texts, in two columns; empty texts are left out.
std::string facts(const std::vector<std::pair<std::string, std::string>>& rows);

/// Rows of a page. Longer tables are split into folded pages of this length.
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
