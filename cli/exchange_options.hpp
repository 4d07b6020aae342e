// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "log_input.hpp"
#include "stored_record.hpp"

namespace axiscal::cli {

/// The formats of `axiscal export`, for shell completion. The program axiscal-exchange, which
/// writes the formats, has its own table.
inline constexpr std::array<std::string_view, 17> export_format_names = {
    "ardupilot", "betaflight", "c-header",  "cpp-header", "csv",   "dcc",
    "iio",       "kalibr",     "label",     "matlab",     "numpy", "openhtf",
    "px4",       "ros",        "tofupilot", "x-io",       "xlsx"};

/// The options of `axiscal export`, with unparsed values.
struct ExportCommand {
  std::vector<std::string> records;
  std::optional<std::string> format, reading_factor, gravity, numbers, name, instance;
  std::optional<std::string> laboratory;
  UnitOptions units;
  StoredRecordOptions stored;
  std::string output = "-";
  bool list = false;
  bool json = false;
  bool lossy = false;
  bool force = false;
};

/// The options of `axiscal import`, with unparsed values.
struct ImportCommand {
  std::string file;
  std::optional<std::string> format, instrument, instance, magnitude;
  std::string output = "-";
  bool json = false;
};

/// Run `axiscal export` and `axiscal import`. Only the program axiscal-exchange calls them.
[[nodiscard]] int run_export(const ExportCommand& command);
[[nodiscard]] int run_import(const ImportCommand& command);

}  // namespace axiscal::cli
