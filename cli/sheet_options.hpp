// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/design_quality.hpp"
#include "axiscal/calib/recording.hpp"
#include "axiscal/positioner/design.hpp"
#include "option_set.hpp"

namespace axiscal::cli {

/// The options of a run sheet, with unparsed values.
struct SheetOptions {
  std::string design = "12";
  std::optional<std::string> replicates, seed, temperatures;
};

void add_sheet_options(OptionSet& options, SheetOptions& sheet);

/// @return the value of --seed; 1 by default.
[[nodiscard]] std::uint64_t seed_of(const SheetOptions& options);

/// @return the number of replicates (--replicates); 1 by default.
[[nodiscard]] int replicates_of(const SheetOptions& options);

/// @return the soak temperatures in --temperatures [degC]; empty by default.
[[nodiscard]] std::vector<double> temperatures_of(const SheetOptions& options);

/// @return the optimal design of N points if the option is `--design optimal:N`; otherwise nullopt.
[[nodiscard]] std::optional<OptimalDesign> optimal_design_of(const SheetOptions& options);

/// @return the points of one replicate of the design in --design.
[[nodiscard]] std::vector<DesignEntry> design_of(const SheetOptions& options);

/// Reads a run sheet from a file. @throws DataError  if the content of the file is invalid.
[[nodiscard]] std::vector<RunSheetRow> read_sheet_file(const std::string& path);

/// @return a new run sheet according to the options.
[[nodiscard]] std::vector<RunSheetRow> make_sheet(const SheetOptions& options);

/// The options of a simulated recording, with unparsed values.
struct RecordingOptions {
  std::optional<std::string> kind, samples, rate;
};

void add_recording_options(OptionSet& options, RecordingOptions& recording);

/// @return the recording to simulate; nullopt if the options request readings at design points
///         instead.
[[nodiscard]] std::optional<Recording> recording_of(const RecordingOptions& options);

}  // namespace axiscal::cli
