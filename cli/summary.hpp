// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/summary.hpp"
#include "axiscal/core/wrapped_text.hpp"

namespace axiscal::cli {

/// Prints to stdout; a reader that has gone away changes nothing of what the status says.
void print_result_text(const std::string& text);

/// Prints a remark on stderr, wrapped to 80 columns.
/// @param what  "note" or "warning".
void print_remark(const char* what, const std::string& text);

}  // namespace axiscal::cli
