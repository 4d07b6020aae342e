// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "log_input.hpp"

namespace axiscal::cli {

/// The options of `axiscal export`, as typed.
struct ExportCommand {
  std::vector<std::string> records;
  std::optional<std::string> format, reading_factor, gravity, numbers, name, instance;
  std::optional<std::string> laboratory;
  UnitOptions units;
  std::string output = "-";
  bool list = false;
  bool lossy = false;
  bool force = false;
};

/// The options of `axiscal import`, as typed.
struct ImportCommand {
  std::string file;
  std::optional<std::string> format, instrument, instance, magnitude;
  std::string output = "-";
};

/// Run the commands, in the program axiscal-exchange.
[[nodiscard]] int run_export(const ExportCommand& command);
[[nodiscard]] int run_import(const ImportCommand& command);

}  // namespace axiscal::cli
