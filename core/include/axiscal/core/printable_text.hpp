// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return the text with control characters replaced by escapes such as \x1B, so that a terminal
///         does not execute them. Tabs and line feeds are kept.
[[nodiscard]] AXISCAL_EXPORT std::string printable_text(std::string_view text);

/// @return the name with all control characters replaced by escapes, including tabs and line feeds.
[[nodiscard]] AXISCAL_EXPORT std::string printable_name(std::string_view name);

/// @return true if a spreadsheet would read the cell as a formula: it begins with =, +, -, @, a tab
///         or a carriage return, and it is neither a number nor a face of the cube such as +X.
[[nodiscard]] AXISCAL_EXPORT bool is_formula(std::string_view cell);

/// @return the word as a CSV cell, with an apostrophe in front if is_formula(word).
[[nodiscard]] AXISCAL_EXPORT std::string formula_safe_cell(const std::string& word);

}  // namespace axiscal
