// SPDX-License-Identifier: Apache-2.0
// Building blocks of HTML pages. Only these functions escape text from outside.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axiscal {

/// @return text escaped for HTML. It cannot contain tags, entities or the end of an attribute.
std::string escaped(std::string_view text);

/// @return text as a quoted string for a style sheet. It cannot end the string or the style
///         element.
std::string css_string(std::string_view text);

/// @return text with a minus sign instead of the hyphen before each number.
std::string typographic_minus(std::string text);

/// @return the name of a face with a minus sign instead of a hyphen.
std::string typographic_face(std::string_view name);

/// @return a coordinate of a drawing, rounded to 0.1.
std::string svg_number(double value);

/// A cell of a table: the displayed text, and the value for copying. If `value` is empty, the text
/// is copied.
struct Cell {
  std::string text;
  std::string value;
};

/// @return a cell with the value rounded by its uncertainty; Cell::value has all digits.
[[nodiscard]] Cell rounded_cell(double value, double uncertainty);

/// @return a cell with a number rounded to `digits` digits; Cell::value has all digits. The text is
///         a dash for NaN.
Cell number_cell(double value, int digits = 5);

/// @return the text of number_cell().
std::string rounded(double value, int digits = 2);

/// @return the cells of a column of values and uncertainties, such as "0.01196 ± 0.00027". They are
///         padded so that the decimal points are aligned. A value of NaN is a dash.
std::vector<Cell> quantity_cells(const std::vector<std::pair<double, double>>& quantities);

enum class Fold {
  never,
  open,
  closed,
};

/// @param title    plain text; the function escapes it.
/// @param content  HTML; if it is empty, the section is left out.
std::string section(const std::string& id,
                    const std::string& title,
                    const std::string& content,
                    Fold fold = Fold::never);
std::string paragraph(const std::string& text);

/// A list of at most 100 lines, and the number of lines that are left out.
std::string bullets(const std::vector<std::string>& lines);

/// A table of names and texts. Rows with an empty text are left out.
std::string facts(const std::vector<std::pair<std::string, std::string>>& rows);

/// Largest number of rows in one table. A longer table is split into folded groups of rows.
inline constexpr std::size_t rows_of_page = 200;

/// A table that the reader can copy. The rows are HTML ("<tr>...").
/// @param caption  may be empty.
std::string paged_table(std::string_view caption,
                        const std::vector<std::string>& head,
                        const std::vector<std::string>& rows);

/// A table that the reader can copy.
/// @param caption  may be empty.
std::string html_table(std::string_view caption,
                       const std::vector<std::string>& head,
                       const std::vector<std::vector<Cell>>& rows);

}  // namespace axiscal
