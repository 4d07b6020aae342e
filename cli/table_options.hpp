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

/// How the columns of a table or a log are called, as typed.
struct TableOptions {
  std::optional<std::string> names, map, time, temperature_column;
};

void add_table_options(OptionSet& options, TableOptions& table);

/// @return the options as the library takes them: --names, and --map with --time and
///         --temperature-column among its columns.
[[nodiscard]] LogFormat format_of(const TableOptions& options);

/// An open table.
struct OpenTable {
  std::unique_ptr<TableText> text;
  std::unique_ptr<CsvReader> csv;
};

/// What is wanted of a table besides its labels.
struct WantedColumns {
  std::vector<std::string> axes;
  /// The kind of instrument that they are of: where the table has none of them, but one sensor of
  /// that kind (or x, y, z), its columns are taken for them, and that is said; empty: never.
  std::string kind;
  /// Unit of the readings that is wanted: columns whose header states another one are converted,
  /// and refused where it is one of another quantity; empty or "1": any.
  std::string unit;
};

/// Opens a table of any look; says in notes how columns were taken.
/// @param read  gives the bytes, where they come from elsewhere than the path.
/// @throws DataError  as TableText, CsvReader.
[[nodiscard]] OpenTable open_table(
    const std::string& path,
    const TableOptions& options,
    const WantedColumns& wanted,
    CsvReader::Quotes quotes = CsvReader::Quotes::span_lines,
    const std::function<std::size_t(char* buffer, std::size_t size)>& read = {});

/// @return the sensor of a table that is of a kind of instrument, or its only one; else nothing.
[[nodiscard]] std::optional<LogSensor> sensor_of_kind(const TableText& table,
                                                      const std::string& kind);

}  // namespace axiscal::cli
