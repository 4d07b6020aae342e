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

/// Adds the option --definitions, for subcommands without add_table_options(), which also adds it.
void add_definitions_option(OptionSet& options, std::optional<std::string>& definitions);

/// Registers the folder --definitions, whose files define the message types in ROS bags. All bags
/// that are read later use these definitions.
/// @throws DataError  if add_message_definitions() throws it.
void take_definitions(const std::optional<std::string>& definitions);

/// Adds the option --limit, for subcommands without add_table_options(), which also adds it.
void add_limit_option(OptionSet& options, std::optional<std::string>& limits);

/// @param limits  value of --limit, in the form NAME=VALUE,..
/// @throws UsageError  if a name is unknown, or a value is not a number.
[[nodiscard]] ReadLimits limits_of(const std::optional<std::string>& limits);

/// @return the format that --map, --names and --limit state. Also registers the folder of
///         --definitions.
[[nodiscard]] LogFormat format_of(const TableOptions& options);

/// An open table.
struct OpenTable {
  std::unique_ptr<TableText> text;
  std::unique_ptr<CsvReader> csv;
};

/// The columns that a reader requests from a table, besides the labels of poses.
struct WantedColumns {
  std::vector<std::string> axes;
  /// Kind of the instrument. If the table lacks the axes, the columns of its only sensor of this
  /// kind are used. If there is no such sensor, the columns x, y, z are used. A note reports this.
  /// If the kind is empty, only the axes are used.
  std::string kind;
  /// Unit to which the readings are converted if a column's header states another unit. Units of
  /// another quantity are refused. If the unit is empty or "1", columns are not converted.
  std::string unit;
  /// Kind of the instrument whose sensor is read from a recording, a flight log or a bag. If it is
  /// empty, such files are refused.
  std::string of_recording;
  /// Kind of the instrument. If it is not empty, columns that name faces in words, for example "X
  /// up", are used as `rest` and `fence`. For an accelerometer, the readings show whether a named
  /// face was up or down. If it is empty, such columns are not used.
  std::string faces_of;
};

/// Opens a table in any layout. Prints notes on the columns that are used.
/// @param read  function that returns the bytes of the table; if it is empty, the file is read.
/// @throws DataError  if TableText or CsvReader cannot read the table.
[[nodiscard]] OpenTable open_table(
    const std::string& path,
    const TableOptions& options,
    const WantedColumns& wanted,
    CsvReader::Quotes quotes = CsvReader::Quotes::span_lines,
    const std::function<std::size_t(char* buffer, std::size_t size)>& read = {});

/// @return the kinds of sensor in recordings that match a kind of instrument; empty if there are
///         none.
/// @param kind  kind of instrument.
[[nodiscard]] std::vector<SeriesKind> kinds_of(const std::string& kind);

/// @return the only sensor of a table that matches a kind of instrument; nullopt if several or none
///         match. If recordings have no sensor of that kind, every sensor matches.
[[nodiscard]] std::optional<LogSensor> sensor_of_kind(const TableText& table,
                                                      const std::string& kind);

}  // namespace axiscal::cli
