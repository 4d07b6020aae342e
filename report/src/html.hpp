// SPDX-License-Identifier: Apache-2.0
// Building blocks of HTML pages. These functions escape all text that comes from files or users.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axiscal {

/// @return text escaped for HTML. It cannot open tags or entities, or end an attribute's value.
std::string escaped(std::string_view text);

/// @return text as a quoted string for CSS. It cannot end the string or the style element.
std::string css_string(std::string_view text);

/// @return text in which the hyphen before each number is replaced by a minus sign.
std::string typographic_minus(std::string text);

/// @return the name of a face with its hyphen replaced by a minus sign.
std::string typographic_face(std::string_view name);

/// @return a coordinate of a drawing, rounded to 0.1.
std::string svg_number(double value);

/// A cell of a table. `text` is displayed. `value` is copied to the clipboard; if it is empty,
/// `text` is copied.
struct Cell {
  std::string text;
  std::string value;
};

/// @return a cell with the value rounded to the digits that its uncertainty justifies; Cell::value
///         has all digits.
[[nodiscard]] Cell rounded_cell(double value, double uncertainty);

/// @return a cell with a number rounded to `digits` significant digits. Cell::value has all digits.
///         The text is a dash if the number is NaN.
Cell number_cell(double value, int digits = 5);

/// @return the text of number_cell().
std::string rounded(double value, int digits = 2);

/// @return the cells of a column of values with uncertainties, such as "0.01196 ± 0.00027". The
///         texts are padded so that the decimal points are aligned. NaN is shown as a dash.
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

/// @return a list of at most 100 lines, followed by the number of lines that are left out.
std::string bullets(const std::vector<std::string>& lines);

/// @return a table of names and texts. A row with an empty text is left out.
std::string facts(const std::vector<std::pair<std::string, std::string>>& rows);

/// Largest number of rows in one table. A longer table is split into folded groups of rows.
inline constexpr std::size_t rows_of_page = 200;

/// @return a table that the reader of the page can copy. `rows` is HTML ("<tr>...").
/// @param caption  may be empty.
std::string paged_table(std::string_view caption,
                        const std::vector<std::string>& head,
                        const std::vector<std::string>& rows);

/// @return a table that the reader of the page can copy.
/// @param caption  may be empty.
std::string html_table(std::string_view caption,
                       const std::vector<std::string>& head,
                       const std::vector<std::vector<Cell>>& rows);

}  // namespace axiscal
