// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/summary.hpp"
#include "axiscal/core/wrapped_text.hpp"

namespace axiscal::cli {

/// Writes a text to a file or, if the path is "-", to stdout. On stdout control characters are
/// replaced by visible text.
void write_text(const std::string& path, const std::string& text);

/// Writes a text to stdout like write_text(). A closed pipe does not change the exit status.
void print_result_text(const std::string& text);

/// Prints the verdict on a calibration as the last line on stdout. On a terminal, its colour shows
/// the status, unless NO_COLOR is set.
void print_verdict(const Calibration& calibration);

/// Sets the option --quiet: print_remark(), print_line() and print_progress() then print nothing.
void set_quiet(bool quiet);
[[nodiscard]] bool is_quiet();

/// Prints a line on stderr that does not report an error.
void print_line(const std::string& text);

/// Shows the progress of the work on one line of stderr, if stderr is a terminal.
/// @param text  text to show; if it is empty, the line is cleared.
void print_progress(const std::string& text);

/// Prints a remark on stderr, wrapped to 80 columns. On a terminal, warnings have a colour.
/// @param what  the label, "note" or "warning".
void print_remark(const char* what, const std::string& text);

}  // namespace axiscal::cli
