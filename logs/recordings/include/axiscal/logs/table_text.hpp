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

/// A table in any layout, converted to CSV text for a CsvReader. The line numbers are those of the
/// file.
///
/// It reads the same delimiters, decimal commas, preambles, encodings, compression, archives,
/// spreadsheets, JSON and arrays as LogFile. In contrast to LogFile the cells stay text, so that
/// labels can be read, and messages can name the line of a defect. Plain CSV stays unchanged.
class TableText {
 public:
  /// @param format  names of the columns of a table without a header; columns to rename or scale.
  ///                If `format.kinds` is not empty, a recording is read as a table of sensors of
  ///                these kinds, as by LogFile.
  /// @throws DataError  if the file does not exist or is not a table. If a flight log or a bag is
  ///                    read without kinds of sensors, the message lists its content.
  explicit TableText(const std::string& path, const LogFormat& format = {});

  /// Makes a table of bytes that another source gives.
  TableText(std::string path,
            std::function<std::size_t(char* buffer, std::size_t size)> read,
            const LogFormat& format = {});

  ~TableText();
  TableText(TableText&&) noexcept;
  TableText& operator=(TableText&&) noexcept;

  /// Makes a reader of the table. It can be called once, and the table must outlive the reader.
  ///
  /// @param known    names of the columns that the caller looks for. If no column has such a name,
  ///                 it is given to the only column with a similar name: the name is followed by a
  ///                 unit, has other capital letters, or is a label ("rest", ..) with more words.
  /// @param renamed  columns to rename, by their names with or without the unit.
  /// @throws DataError  if a column to rename does not exist, or for the reasons of CsvReader's
  ///                    constructor.
  [[nodiscard]] CsvReader reader(const std::vector<std::string>& known,
                                 const std::vector<MappedColumn>& renamed = {},
                                 CsvReader::Quotes quotes = CsvReader::Quotes::span_lines);

  /// @return the columns of the header, split into name and unit; empty if the file could not be
  ///         parsed as a table.
  [[nodiscard]] const std::vector<NamedColumn>& columns() const;

  /// @return the sensors among the columns, recognised by names and units, or otherwise by the
  ///         numbers of the first rows.
  [[nodiscard]] std::vector<LogSensor> sensors() const;

  /// @return the first rows as numbers, a vector for each column, with NaN for words; empty if the
  ///         file could not be parsed as a table.
  [[nodiscard]] const LogBlock& first_rows() const;

  /// @return the cells of the first rows, row by row; empty if the file is not text.
  [[nodiscard]] const std::vector<std::vector<std::string>>& first_cells() const;

  /// @return the names of numeric columns whose names have no meaning, such as c1 or data_2,
  ///         without the column of times.
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
