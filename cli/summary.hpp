// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal::cli {

/// A calibration for people: what was done, coefficients, levelness, quality; 80 columns.
[[nodiscard]] std::string summary_text(const Calibration& calibration);

/// Prints to stdout; a reader that has gone away changes nothing of what the status says.
void print_result_text(const std::string& text);

/// Prints a remark on stderr, wrapped to 80 columns.
/// @param what  "note" or "warning".
void print_remark(const char* what, const std::string& text);

/// @return the text broken at blanks into lines of at most `width` columns, later ones indented.
[[nodiscard]] std::string wrapped(const std::string& text, std::size_t width);

}  // namespace axiscal::cli
