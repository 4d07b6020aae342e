// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "stored_record.hpp"
#include "table_options.hpp"

namespace axiscal::cli {

/// The options of `axiscal report`, with unparsed values.
struct ReportCommand {
  std::string record;
  std::optional<std::string> observations, history, noise, laboratory, positioner, adjusters,
      thread_pitch;
  std::optional<std::string> fleet, kind, model, since, until, limits;
  TableOptions table;
  StoredRecordOptions stored;
  std::string output;
  bool json = false;
};

/// Runs `axiscal report --fleet`, which reports on all units of a store. Only the program
/// axiscal-report calls it.
[[nodiscard]] int run_fleet(const ReportCommand& command);

/// Runs `axiscal report`. Only the program axiscal-report calls it.
[[nodiscard]] int run_report(const ReportCommand& command);

}  // namespace axiscal::cli
