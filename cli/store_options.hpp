// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace axiscal::cli {

/// The options of `axiscal store`, with unparsed values.
struct StoreCommand {
  std::string action;
  std::vector<std::string> files;
  std::string store;
  std::string output = "-";
  std::optional<std::string> serial, slot, model, kind, status, station, batch, operated_by;
  std::optional<std::string> since, until, at;
  bool yield = false;
  bool json = false;
};

/// Runs `axiscal store`. Only the program axiscal-store calls it.
[[nodiscard]] int run_store(const StoreCommand& command);

}  // namespace axiscal::cli
