// SPDX-License-Identifier: Apache-2.0
#include "sheet_options.hpp"

#include <charconv>

#include <system_error>

#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "input.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {

void add_sheet_options(OptionSet& options, SheetOptions& sheet) {
  options.add("--design", sheet.design, "DESIGN",
              "6, 12 or 24 points, optimal:N (the N best of the 24), or a FILE [default: 12]");
  options.add("--replicates", sheet.replicates, "N",
              "repetitions of the whole design [default: 1]");
  options.add("--seed", sheet.seed, "S", "seed of the random order [default: 1]");
  options.add("--temperatures", sheet.temperatures, "T,T,..",
              "temperatures of the soaks; the whole design with all replicates is read at each "
              "one");
}

std::uint64_t seed_of(const SheetOptions& options) {
  if (!options.seed) {
    return 1;
  }
  std::uint64_t seed = 0;
  const char* end = options.seed->data() + options.seed->size();
  const auto [stop, error] = std::from_chars(options.seed->data(), end, seed);
  if (error != std::errc{} || stop != end) {
    throw UsageError(
        formatted("--seed: '{}' is not a whole number from 0 to 2^64 - 1", *options.seed));
  }
  return seed;
}

int replicates_of(const SheetOptions& options) {
  constexpr int most_replicates = 100000;
  if (!options.replicates) {
    return 1;
  }
  const int replicates = parse_integer(*options.replicates).value_or(0);
  if (replicates < 1 || replicates > most_replicates) {
    throw UsageError(formatted("--replicates: '{}' is not a whole number from 1 to 100000",
                               *options.replicates));
  }
  return replicates;
}

std::vector<double> temperatures_of(const SheetOptions& options) {
  std::vector<double> temperatures;
  if (options.temperatures) {
    for (const std::string_view text : split(*options.temperatures, ',')) {
      temperatures.push_back(number_of("--temperatures", std::string(text)));
    }
  }
  return temperatures;
}

std::optional<OptimalDesign> optimal_design_of(const SheetOptions& options) {
  constexpr std::string_view optimal = "optimal:";
  if (!options.design.starts_with(optimal)) {
    return std::nullopt;
  }
  const std::optional<int> points = parse_integer(options.design.substr(optimal.size()));
  if (!points || *points < 4 || *points > 24) {
    throw UsageError(
        formatted("--design: '{}' must be optimal:N with N from 4 to 24", options.design));
  }
  return optimal_design(*points, Eigen::Vector3d::UnitZ(), seed_of(options));
}

std::vector<DesignEntry> design_of(const SheetOptions& options) {
  if (options.design == "6" || options.design == "12" || options.design == "24") {
    return standard_design(*parse_integer(options.design));
  }
  if (const std::optional<OptimalDesign> optimal = optimal_design_of(options)) {
    return optimal->design;
  }
  if (parse_number(options.design)) {
    throw UsageError("--design: the designs have 6, 12 or 24 points, not " + options.design);
  }
  const OpenTable table = open_table(options.design, {}, {});
  return read_design(*table.csv);
}

std::vector<RunSheetRow> read_sheet_file(const std::string& path) {
  const OpenTable table = open_table(path, {}, {});
  return read_run_sheet(*table.csv);
}

std::vector<RunSheetRow> make_sheet(const SheetOptions& options) {
  const int replicates = replicates_of(options);
  const std::uint64_t seed = seed_of(options);
  return make_run_sheet(design_of(options), replicates, seed, temperatures_of(options));
}

void add_recording_options(OptionSet& options, RecordingOptions& recording) {
  options.add("--recording", recording.kind, "free|sweep|turns",
              "simulate a log of an instrument that is turned by hand (free), that rests while the "
              "temperature changes (sweep), or of a gyroscope that rests and turns (turns)");
  options.add("--samples", recording.samples, "N", "samples of the recording [default: 6000]");
  options.add("--rate", recording.rate, "HZ", "samples per second [default: 100]");
}

std::optional<Recording> recording_of(const RecordingOptions& options) {
  if (!options.kind) {
    if (options.samples || options.rate) {
      throw UsageError("--samples, --rate: require --recording");
    }
    return std::nullopt;
  }
  const std::optional<RecordingKind> kind = parse_recording(*options.kind);
  if (!kind) {
    throw UsageError(
        formatted("--recording: '{}' must be 'free', 'sweep' or 'turns'", *options.kind));
  }
  Recording recording{.kind = *kind};
  if (options.samples) {
    recording.samples =
        static_cast<std::size_t>(parse_whole_number("--samples", *options.samples, 1));
  }
  if (options.rate) {
    recording.rate_hz = parse_positive("--rate", *options.rate);
  }
  return recording;
}

}  // namespace axiscal::cli
