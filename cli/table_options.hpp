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

/// The options for the columns of a table or a log, with unparsed values.
struct TableOptions {
  std::optional<std::string> names, map, time, temperature_column, definitions, limits;
};

void add_table_options(OptionSet& options, TableOptions& table);

/// Adds the option --definitions. add_table_options() adds it too.
void add_definitions_option(OptionSet& options, std::optional<std::string>& definitions);

/// Registers the folder of message definitions for all later readers of bags.
/// @throws DataError  if add_message_definitions() throws it.
void take_definitions(const std::optional<std::string>& definitions);

/// Adds the option --limit. add_table_options() adds it too.
void add_limit_option(OptionSet& options, std::optional<std::string>& limits);

/// @param limits  value of --limit: NAME=VALUE,..
/// @throws UsageError  if a name is unknown, or a value is not a number.
[[nodiscard]] ReadLimits limits_of(const std::optional<std::string>& limits);

/// @return the format according to --map, --names and --limit. Also registers --definitions.
[[nodiscard]] LogFormat format_of(const TableOptions& options);

/// An open table.
struct OpenTable {
  std::unique_ptr<TableText> text;
  std::unique_ptr<CsvReader> csv;
};

/// The requested columns of a table, besides its labels.
struct WantedColumns {
  std::vector<std::string> axes;
  /// The kind of the instrument. If the table lacks the axes but has one sensor of that kind (or x,
  /// y, z), the sensor's columns are used, with a note. Empty: only the axes are used.
  std::string kind;
  /// Requested unit of the readings. Columns whose header states another unit are converted, or
  /// refused if that unit is of another quantity. Empty or "1": columns are not converted.
  std::string unit;
  /// Kind of instrument whose sensor is read from a recording, a flight log or a bag. Empty: a
  /// recording is refused.
  std::string of_recording;
  /// Kind of instrument, if columns with words for faces may be used as `rest` and `fence`. The
  /// readings of an accelerometer show whether a named face was up or down. Empty: such columns are
  /// not used.
  std::string faces_of;
};

/// Opens a table in any layout. Prints notes on the columns that are used.
/// @param read  function that returns the bytes of the table; empty: they are read from the path.
/// @throws DataError  if TableText or CsvReader cannot read the table.
[[nodiscard]] OpenTable open_table(
    const std::string& path,
    const TableOptions& options,
    const WantedColumns& wanted,
    CsvReader::Quotes quotes = CsvReader::Quotes::span_lines,
    const std::function<std::size_t(char* buffer, std::size_t size)>& read = {});

/// @return the kind of sensor to look for in recordings; empty if recordings have no such sensor.
/// @param kind  kind of instrument.
[[nodiscard]] std::vector<SeriesKind> kinds_of(const std::string& kind);

/// @return the sensor of a table that matches a kind of instrument; nullopt unless there is exactly
///         one. If the kind matches no sensor at all, every sensor matches.
[[nodiscard]] std::optional<LogSensor> sensor_of_kind(const TableText& table,
                                                      const std::string& kind);

}  // namespace axiscal::cli
