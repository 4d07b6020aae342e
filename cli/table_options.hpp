// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/logs/table_text.hpp"
#include "option_set.hpp"

namespace axiscal::cli {

/// The names of the columns of a table or a log, as typed.
struct TableOptions {
  std::optional<std::string> names, map, time, temperature_column, definitions, limits;
};

void add_table_options(OptionSet& options, TableOptions& table);

/// --definitions, which goes with the table's options too.
void add_definitions_option(OptionSet& options, std::optional<std::string>& definitions);

/// Makes the definitions known to all readers of bags.
/// @throws DataError  as add_message_definitions().
void take_definitions(const std::optional<std::string>& definitions);

/// --limit, which goes with the table's options too.
void add_limit_option(OptionSet& options, std::optional<std::string>& limits);

/// @return the limits as typed: NAME=VALUE,..
/// @throws UsageError  if a name is not known, or a value is not a number.
[[nodiscard]] ReadLimits limits_of(const std::optional<std::string>& limits);

/// @return the options as the library takes them: --names, and --map with --time and
///         --temperature-column among its columns.
[[nodiscard]] LogFormat format_of(const TableOptions& options);

/// An open table.
struct OpenTable {
  std::unique_ptr<TableText> text;
  std::unique_ptr<CsvReader> csv;
};

/// The requested columns of a table, besides its labels.
struct WantedColumns {
  std::vector<std::string> axes;
  /// The kind of the instrument. If the table lacks its axes but has one sensor of that kind (or x,
  /// y, z), its columns are used, with a note; empty: never.
  std::string kind;
  /// Unit of the readings that is wanted: columns whose header states another one are converted,
  /// and refused where it is one of another quantity; empty or "1": any.
  std::string unit;
  /// Kind of instrument whose sensor is read of a recording, a flight log or a bag. Empty: a
  /// recording is refused.
  std::string of_recording;
  /// Kind of instrument, if a column of faces in words may be used as `rest` or `fence`: the
  /// readings of an accelerometer then show if a named face was up or down. Empty: never.
  std::string faces_of;
};

/// Opens a table of any look; says in notes how columns were taken.
/// @param read  returns the bytes, if they do not come from the path.
/// @throws DataError  as TableText, CsvReader.
[[nodiscard]] OpenTable open_table(
    const std::string& path,
    const TableOptions& options,
    const WantedColumns& wanted,
    CsvReader::Quotes quotes = CsvReader::Quotes::span_lines,
    const std::function<std::size_t(char* buffer, std::size_t size)>& read = {});

/// @return the kind of sensor that an instrument of a kind is, to be looked for in recordings;
/// empty if
///         it is none that they hold.
[[nodiscard]] std::vector<SeriesKind> kinds_of(const std::string& kind);

/// @return the sensor of a table that is of a kind of instrument, or its only one; else nothing.
[[nodiscard]] std::optional<LogSensor> sensor_of_kind(const TableText& table,
                                                      const std::string& kind);

}  // namespace axiscal::cli
