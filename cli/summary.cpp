// SPDX-License-Identifier: Apache-2.0
#include "summary.hpp"

#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/printable_text.hpp"
#include "core/formatted.hpp"
#include "core/redirected_streams.hpp"

namespace axiscal::cli {
namespace {

constexpr const char* green = "32";
constexpr const char* yellow = "33";
constexpr const char* red = "31";

// Returns true if a descriptor is a terminal with colours and NO_COLOR is not set (no-color.org).
bool has_colours(int descriptor) {
  const char* const none = std::getenv("NO_COLOR");
  const char* const terminal = std::getenv("TERM");
  return ::isatty(descriptor) == 1 && (none == nullptr || *none == '\0') && terminal != nullptr &&
         std::string_view(terminal) != "dumb";
}

bool quiet_output = false;

std::string coloured(const std::string& text, const char* colour, int descriptor) {
  return has_colours(descriptor) ? formatted("\x1b[1;{}m{}\x1b[0m", colour, text) : text;
}

}  // namespace

void write_text(const std::string& path, const std::string& text) {
  write_whole_file(path, path == "-" ? printable_text(text) : text);
}

void print_result_text(const std::string& text) {
  write_text("-", text);
}

void print_verdict(const Calibration& calibration) {
  const CalibrationStatus status = calibration.findings.status;
  const bool failed =
      status == CalibrationStatus::refused ||
      (calibration.findings.verdict && !calibration.findings.verdict->passed) ||
      (calibration.findings.confirmation && !calibration.findings.confirmation->passed);
  const std::string& slot = calibration.provenance.slot;
  write_whole_file("-", formatted("{}{}\n", slot.empty() ? "" : formatted("slot {}: ", slot),
                                  coloured(verdict_sentence(calibration),
                                           failed                                 ? red
                                           : status == CalibrationStatus::warning ? yellow
                                                                                  : green,
                                           STDOUT_FILENO)));
}

void set_quiet(bool quiet) {
  quiet_output = quiet;
}

bool is_quiet() {
  return quiet_output;
}

void print_line(const std::string& text) {
  if (!quiet_output) {
    print_error(printable_text(text) + "\n");
  }
}

void print_progress(const std::string& text) {
  if (!quiet_output && ::isatty(STDERR_FILENO) == 1) {
    std::fprintf(stderr, "\r\x1b[K%s", printable_text(text).c_str());
  }
}

void print_remark(const char* what, const std::string& text) {
  if (quiet_output) {
    return;
  }
  std::string shown = wrapped(formatted("{}: {}", what, printable_text(text)), 80);
  const std::string_view name(what);
  if (name == "warning") {
    shown.replace(0, name.size(), coloured(what, yellow, STDERR_FILENO));
  }
  print_error(shown + "\n");
}

}  // namespace axiscal::cli
