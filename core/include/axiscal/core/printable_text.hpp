// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return the text with control characters replaced by escapes such as \x1B, so that a terminal
///         does not execute them. Tabs and line feeds are kept.
[[nodiscard]] AXISCAL_EXPORT std::string printable_text(std::string_view text);

/// @return a name as printable_text(), but with tabs and line feeds replaced too.
[[nodiscard]] AXISCAL_EXPORT std::string printable_name(std::string_view name);

/// @return true if a spreadsheet would read the cell as a formula: it begins with =, +, -, @, a tab
///         or a carriage return, and it is not a number or a face (+X).
[[nodiscard]] AXISCAL_EXPORT bool is_formula(std::string_view cell);

/// @return a word as a CSV cell; a formula gets an apostrophe in front.
[[nodiscard]] AXISCAL_EXPORT std::string formula_safe_cell(const std::string& word);

}  // namespace axiscal
