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

/// A table in any layout, converted to CSV text for a CsvReader. Each line keeps the line number
/// that it has in the file.
///
/// The class reads the same formats as LogFile: delimiters, decimal commas, preambles, encodings,
/// compression, archives, spreadsheets, JSON and arrays. In contrast to LogFile the cells stay
/// text, so that labels can be read, and messages can name the line of a defect. Plain CSV stays
/// unchanged.
class TableText {
 public:
  /// @param format  names the columns of a table without a header, and the columns to rename or
  ///                scale. If `format.kinds` is not empty, a recording is converted to a table of
  ///                the sensors of these kinds.
  /// @throws DataError  if the file does not exist or is not a table. If it is a flight log or a
  ///                    bag and `format.kinds` is empty, the message lists its content.
  explicit TableText(const std::string& path, const LogFormat& format = {});

  /// Reads a table from a function instead of a file.
  /// @param read  writes the next bytes to `buffer`, at most `size` of them, and returns their
  ///              number; 0 at the end.
  TableText(std::string path,
            std::function<std::size_t(char* buffer, std::size_t size)> read,
            const LogFormat& format = {});

  ~TableText();
  TableText(TableText&&) noexcept;
  TableText& operator=(TableText&&) noexcept;

  /// Makes a reader of the table. It can be called once, and the table must outlive the reader.
  ///
  /// @param known    names of the columns that the caller looks for. If no column has such a name,
  ///                 and exactly one column has a similar name, this column is renamed. A similar
  ///                 name differs only by a unit or by capital letters. A name similar to rest,
  ///                 fence, run or block may also contain further words ("Rest face").
  /// @param renamed  columns to rename, by their names with or without the unit.
  /// @throws DataError  if a column to rename does not exist, or if CsvReader's constructor throws
  ///                    it.
  [[nodiscard]] CsvReader reader(const std::vector<std::string>& known,
                                 const std::vector<MappedColumn>& renamed = {},
                                 CsvReader::Quotes quotes = CsvReader::Quotes::span_lines);

  /// @return the columns of the header, split into name and unit; empty if the file could not be
  ///         parsed as a table.
  [[nodiscard]] const std::vector<NamedColumn>& columns() const;

  /// @return the sensors among the columns. They are recognised by names and units, or otherwise by
  ///         the values in the first rows.
  [[nodiscard]] std::vector<LogSensor> sensors() const;

  /// @return the numbers in the first rows, with a vector for each column. Words become NaN. The
  ///         result is empty if the file could not be parsed as a table.
  [[nodiscard]] const LogBlock& first_rows() const;

  /// @return the cells of the first rows, row by row; empty if the file is not text.
  [[nodiscard]] const std::vector<std::vector<std::string>>& first_cells() const;

  /// @return the names of the numeric columns that have meaningless names, such as c1 or data_2.
  ///         The column of times is excluded.
  [[nodiscard]] std::vector<std::string> unnamed_numbers() const;

  /// @return notes on the format of the table.
  [[nodiscard]] const std::vector<std::string>& notes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Shows a line of a table with a mark under the cell of a column, for messages.
/// @param line    number of the line, from 1.
/// @param column  name of the column. If there is no such column, the line is shown without a mark.
/// @return one or two lines of text; empty if the file cannot be read.
[[nodiscard]] std::string marked_cell(const std::string& path,
                                      std::size_t line,
                                      const std::string& column);

}  // namespace axiscal
