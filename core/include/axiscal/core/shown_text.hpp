// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return the text with control characters written as \x1B: a terminal would act on them. Tabs and
///         line feeds stay.
[[nodiscard]] AXISCAL_EXPORT std::string shown_text(std::string_view text);

/// @return a name as shown_text(), in one line: tabs and line feeds are written so too.
[[nodiscard]] AXISCAL_EXPORT std::string shown_name(std::string_view name);

/// @return true if a spreadsheet reads a cell as a formula: it begins with = + - or @. A number and
///         a face (+X) are not formulas.
[[nodiscard]] AXISCAL_EXPORT bool is_formula(std::string_view cell);

/// @return a word as a cell of CSV, with an apostrophe before a formula.
[[nodiscard]] AXISCAL_EXPORT std::string harmless_cell(const std::string& word);

}  // namespace axiscal
