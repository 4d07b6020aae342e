// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/summary.hpp"
#include "axiscal/core/wrapped_text.hpp"

namespace axiscal::cli {

/// Writes a text for people: on stdout control characters are shown, not sent.
void write_text(const std::string& path, const std::string& text);

/// The same to stdout. The exit status stays the same if the reader has gone away.
void print_result_text(const std::string& text);

/// Prints how a calibration ended, its last line on stdout; in the colour of its status on a
/// terminal, unless NO_COLOR is set.
void print_verdict(const Calibration& calibration);

/// The option --quiet: print_remark(), print_line() and print_progress() print nothing.
void set_quiet(bool quiet);
[[nodiscard]] bool is_quiet();

/// Prints a line on stderr that is not an error.
void print_line(const std::string& text);

/// Shows how far the work is, on one line of stderr, if that is a terminal.
/// @param text  empty: the line is cleared.
void print_progress(const std::string& text);

/// Prints a remark on stderr, wrapped to 80 columns; warnings in colour on a terminal.
/// @param what  the label, "note" or "warning".
void print_remark(const char* what, const std::string& text);

}  // namespace axiscal::cli
