// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace axiscal {

/// One column of a log as a calibration wants it: value = factor * (column, or its negative).
struct MappedColumn {
  std::string name;     ///< as the calibration calls it
  std::string column;   ///< as the log calls it
  double factor = 1.0;  ///< also the sign: -1 turns an axis round
};

/// How a log is to be read; all can be left to be found out.
struct LogFormat {
  std::vector<std::string>
      names;  ///< what the columns are called where the log has no header; else c1, c2, ...
  std::vector<MappedColumn> columns;  ///< renamed or scaled; the others stay as they are
};

/// Reads a mapping of columns: {"format": "axiscal-log", "version": 1, "names": [..],
/// "columns": {"x": "acc_x", "y": {"column": "acc_y", "factor": -9.81}}}.
/// @throws DataError  `PATH: /json/pointer: ...`.
[[nodiscard]] LogFormat read_log_format(const std::string& path);

/// Samples, a column for each quantity, all of one length.
using LogBlock = std::vector<std::vector<double>>;

/// @return the position of a column among others, or nothing.
[[nodiscard]] std::optional<std::size_t> find_column(const std::vector<std::string>& columns,
                                                     const std::string& name);

/// @param path  of the log, for the message.
/// @return the position of a column.
/// @throws DataError  if there is none of that name; the message lists those that there are.
[[nodiscard]] std::size_t need_column(const std::string& path,
                                      const std::vector<std::string>& columns,
                                      const std::string& name);

/// What was not as it should be in a log.
struct LogDefects {
  std::size_t ragged_rows = 0;  ///< left out: another number of cells than the first
  std::size_t first_ragged_line = 0;
  std::size_t missing_numbers = 0;  ///< cells that are no finite number; they read as NaN
  std::size_t first_missing_line = 0;
};

/// A raw recording, read block by block in constant memory.
///
/// Text: comma, semicolon, tab or blanks between the cells, decimal point or comma, with or without
/// a header, lines before it skipped; `#` and `%` begin comments. Compressed by gz, bz2, xz or zst.
/// NumPy's .npy. MATLAB's .mat (v5, v7.3), of which all columns are held in memory. What a file is,
/// is seen from its first bytes, not from its name; `-` is standard input.
class LogFile {
 public:
  /// @throws DataError  if there is no such file, it is empty or damaged, or no table is in it.
  explicit LogFile(const std::string& path, const LogFormat& format = {});

  /// Samples that are in memory already.
  /// @param name     for messages.
  /// @param columns  names, one for each column.
  /// @param samples  the columns, of one length.
  LogFile(std::string name, std::vector<std::string> columns, LogBlock samples);

  ~LogFile();
  LogFile(LogFile&&) noexcept;
  LogFile& operator=(LogFile&&) noexcept;

  /// @return the columns' names, as mapped.
  [[nodiscard]] const std::vector<std::string>& columns() const;

  /// As need_column().
  [[nodiscard]] std::size_t need(const std::string& name) const;

  /// From now on read() gives these columns only, in this order.
  void select(std::vector<std::size_t> columns);

  /// Reads the next samples into a block.
  ///
  /// @param block overwritten: a column for each that is selected.
  /// @param most   at most so many samples; fewer come of a file with thousands of columns.
  /// @return how many; 0 at the end.
  /// @throws DataError  if the file is damaged from here on (a truncated .gz, say).
  [[nodiscard]] std::size_t read(LogBlock& block, std::size_t most);

  [[nodiscard]] const LogDefects& defects() const;

  /// @return what a reader may want to know: "columns parted by ';', decimal comma", ...
  [[nodiscard]] const std::vector<std::string>& notes() const;

  [[nodiscard]] const std::string& path() const;

  class Source;

 private:
  std::unique_ptr<Source> source_;
  std::vector<std::string> columns_;
  std::vector<double> factors_;   // what every column is multiplied with
  std::vector<double> selected_;  // factors of the selected ones
  std::string path_;
};

/// Reads a whole log.
[[nodiscard]] LogBlock read_log(LogFile& log);

}  // namespace axiscal
