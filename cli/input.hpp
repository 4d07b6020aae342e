// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/design_quality.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/tolerance.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/surface.hpp"
#include "command_line.hpp"

namespace axiscal::cli {

/// A table of observations and the SHA-256 of its file.
struct ObservationsFile {
  ObservationsTable table;
  Observations beside;  ///< of the columns asked for beside them; else empty
  std::string sha256;
};

/// @param beside  columns of another instrument in the same rows.
/// @throws DataError  as read_observations().
[[nodiscard]] ObservationsFile read_observations_file(
    const std::string& path,
    const ObservationColumns& columns,
    const std::optional<ObservationColumns>& beside = {});

/// @return the SHA-256 of a file's bytes; empty for standard input and pipes,
///         which are read once only.
[[nodiscard]] std::string sha256_of_file(const std::string& path);

/// A reader of an open file; the file must outlive it.
[[nodiscard]] CsvReader csv_reader_of(InputFile& file,
                                      CsvReader::Quotes quotes = CsvReader::Quotes::span_lines);

/// @return a record that a result may rest on.
/// @throws RefusedError  if its calibration was refused, and `force` is not set.
[[nodiscard]] Calibration read_unrefused(const std::string& record, bool force);

/// @return the best design of so many points where `--design optimal:N` asks for it, else nothing.
[[nodiscard]] std::optional<OptimalDesign> optimal_design_of(const SheetOptions& options);

/// The design that the options ask for: one replicate.
[[nodiscard]] std::vector<DesignEntry> design_of(const SheetOptions& options);

/// @return the replicates of the options, 1 by default.
[[nodiscard]] int replicates_of(const SheetOptions& options);

/// @return the soak levels of the options; none by default.
[[nodiscard]] std::vector<double> temperatures_of(const SheetOptions& options);

/// The value of --tolerances: NAME=SD,.. @throws UsageError for a name or number that is none.
[[nodiscard]] Tolerances tolerances_of(const std::string& text);

/// @return the feet of a cube: its own, and where a face has none those of the usual frame.
[[nodiscard]] CubeFeet drawing_of(const Positioner& positioner);

/// The run sheet that the options ask for.
[[nodiscard]] std::vector<RunSheetRow> make_sheet(const SheetOptions& options);

/// @return the seed of the options, 1 by default.
[[nodiscard]] std::uint64_t seed_of(const SheetOptions& options);

/// A typed value as a number. @throws UsageError naming the option.
[[nodiscard]] double number_of(std::string_view option, const std::string& text);

/// A typed value as `count` numbers parted by commas. @throws UsageError naming the option.
[[nodiscard]] std::vector<double> numbers_of(std::string_view option,
                                             const std::string& text,
                                             std::size_t count);

/// A typed value as a range LO,HI. @throws UsageError naming the option.
[[nodiscard]] ReadingRange range_of(std::string_view option, const std::string& text);

/// A typed value as a number above 0. @throws UsageError naming the option.
[[nodiscard]] double positive_of(std::string_view option, const std::string& text);

/// A typed value as a number that is not negative. @throws UsageError naming the option.
[[nodiscard]] double not_negative_of(std::string_view option, const std::string& text);

/// A typed value as a whole number that is not less. @throws UsageError naming the option.
[[nodiscard]] int whole_number_of(std::string_view option, const std::string& text, int least);

/// --adjusters and --thread-pitch, over those of a positioner's table.
/// @throws UsageError  where there are no adjusters, or they cannot level a table.
void set_adjusters(const std::optional<std::string>& adjusters,
                   const std::optional<std::string>& thread_pitch,
                   Surface& surface);

/// A typed value as a pitch formula, asin or atan2. @throws UsageError naming the option.
[[nodiscard]] PitchFormula pitch_formula_of(std::string_view option, const std::string& text);

/// The site of --latitude, --longitude and --height; what is not given is as in `otherwise`.
/// @throws UsageError for one out of range.
[[nodiscard]] Site site_of_options(const std::optional<std::string>& latitude,
                                   const std::optional<std::string>& longitude,
                                   const std::optional<std::string>& height,
                                   Site otherwise);

/// The value of --date: seconds since 1970, UTC. @throws UsageError for one that is no date.
[[nodiscard]] double date_of_option(const std::string& text);

/// The value of --slope. @throws UsageError unless X^2 + Y^2 < 1.
[[nodiscard]] Eigen::Vector2d slope_of_option(const std::string& text);

/// The value of --method. @throws UsageError for one that is not known.
[[nodiscard]] Method method_of_option(const std::string& text);

/// The value of --level-by. @throws UsageError for one that is not known.
[[nodiscard]] LevelBy level_by_of_option(const std::string& text);

}  // namespace axiscal::cli
