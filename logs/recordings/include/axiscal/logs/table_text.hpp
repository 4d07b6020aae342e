// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/sensor_names.hpp"

namespace axiscal {

/// A table of any look, as a CsvReader reads it: rows of text with commas between the cells, in the
/// lines in which the file has them.
///
/// Delimiters, decimal commas, a preamble, encodings, compression, archives, spreadsheets, JSON and
/// arrays as LogFile; unlike it the cells stay text, so that labels and defects can be told by
/// line. A plain table passes unchanged.
class TableText {
 public:
  /// @param format  names of columns without a header; columns renamed, scaled, turned round. Kinds
  /// of
  ///                sensors: a recording is a table of theirs, as LogFile makes it.
  /// @throws DataError  if the file does not exist or is not a table. For a flight log or a bag the
  ///                    message lists its content, if no kinds are named.
  explicit TableText(const std::string& path, const LogFormat& format = {});

  /// Bytes that come from elsewhere.
  TableText(std::string path,
            std::function<std::size_t(char* buffer, std::size_t size)> read,
            const LogFormat& format = {});

  ~TableText();
  TableText(TableText&&) noexcept;
  TableText& operator=(TableText&&) noexcept;

  /// A reader of the table; once, and the table must outlive it.
  ///
  /// @param known  names by which columns are asked for. Where the table has none of that name, but
  ///               one whose name without its unit, or but for capital letters, is the same, that
  ///               one is called so.
  /// @param renamed  columns that are called otherwise, by their names with or without the unit.
  /// @throws DataError  where a column that is to be renamed is not there; as CsvReader.
  [[nodiscard]] CsvReader reader(const std::vector<std::string>& known,
                                 const std::vector<MappedColumn>& renamed = {},
                                 CsvReader::Quotes quotes = CsvReader::Quotes::span_lines);

  /// @return the columns as the header has them, parted into name and unit; empty where the table
  ///         could not be looked at.
  [[nodiscard]] const std::vector<NamedColumn>& columns() const;

  /// @return the sensors among the columns: by names and units, else by the numbers of the first
  ///         rows.
  [[nodiscard]] std::vector<LogSensor> sensors() const;

  /// @return the first rows as numbers, a vector for each column, NaN for words; empty if the table
  ///         could not be looked at.
  [[nodiscard]] const LogBlock& first_rows() const;

  /// @return the cells of the first rows, row by row; empty for a table of numbers alone.
  [[nodiscard]] const std::vector<std::vector<std::string>>& first_cells() const;

  /// @return the columns of numbers with meaningless names, as c1 or data_2, without times.
  [[nodiscard]] std::vector<std::string> unnamed_numbers() const;

  /// @return the format, in words.
  [[nodiscard]] const std::vector<std::string>& notes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A line of a table with a mark under the cell of a column, for people.
/// @param line    counted from 1.
/// @param column  its name in messages; without such a column the line is shown without a mark.
/// @return two lines of text, or empty where the file cannot be looked at.
[[nodiscard]] std::string marked_cell(const std::string& path,
                                      std::size_t line,
                                      const std::string& column);

}  // namespace axiscal
