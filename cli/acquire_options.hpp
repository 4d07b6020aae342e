// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "experiment_options.hpp"
#include "sheet_options.hpp"

namespace axiscal::cli {

struct AcquireCommand {
  std::vector<std::string> arguments;  ///< the whole command line, which the journal stores
  std::vector<std::string> sources;
  ExperimentOptions experiment;
  SheetOptions sheet;
  std::optional<std::string> plan, noise, window, dwell, placement_u;
  std::optional<std::string> soak_window, soak_tolerance, temperature_column;
  std::optional<std::string> name, journal, resume, output, record, report;
  std::optional<std::string> check, readings, within;
  std::optional<std::string> listen, port, enough_deg;
  bool list = false;
  bool free = false;
  bool manual = false;
  bool unattended = false;
  bool raw = false;
  bool plain = false;
  bool json = false;
  bool web = false;
};

/// Parses the command line that is stored in a journal.
/// @param path  file name of the journal, for messages.
/// @throws DataError  if the subcommand is not `acquire`.
[[nodiscard]] AcquireCommand parse_acquire_command(const std::vector<std::string>& arguments,
                                                   const std::string& path);

/// Runs `axiscal acquire`. Only the program axiscal-acquire calls it.
[[nodiscard]] int run_acquire(const AcquireCommand& command);

}  // namespace axiscal::cli
