// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/logs/recorded_sensor.hpp"
#include "axiscal/logs/recording_file.hpp"

namespace axiscal {

/// One column of a log as a calibration wants it: value = factor * (column, or its negative).
struct MappedColumn {
  std::string name;     ///< as the calibration calls it
  std::string column;   ///< as the log calls it
  double factor = 1.0;  ///< also the sign: -1 turns an axis round
  /// TableText: the cell that stands for one: "-X" for "X up". None: the cells stay as they are.
  std::function<std::string(const std::string& cell)> of_cell = {};
};

/// Options for reading a log; all have automatic defaults.
struct LogFormat {
  std::vector<std::string>
      names;  ///< names of the columns if the log lacks a header; default: c1, c2, ...
  std::vector<MappedColumn> columns;  ///< renamed or scaled; the others stay as they are
  /// Of recordings that hold several sensors of a kind: which, counted from 0.
  int instance = 0;
  /// Of such recordings: the kinds of sensors that are wanted; empty: all. A single kind comes at
  /// its own times, not interpolated.
  std::vector<SeriesKind> kinds;
  /// Of such recordings: columns that are wanted by the names that the format has for them, alone
  /// ("AccX") or behind their message's ("IMU2.AccX").
  std::vector<std::string> wanted;
  ReadLimits limits;  ///< the most that reading the file may cost
};

/// A sensor of three axes among the columns of a log.
struct LogSensor {
  SeriesKind kind = SeriesKind::other;
  std::array<std::string, 3> columns;  ///< of x, y, z, as the log calls them
  std::string unit;                    ///< empty: not known
  int number = 0;                      ///< of its kind in the recording, counted from 0
  int of = 1;                          ///< number of sensors of this kind in the recording
  std::string device;                  ///< the device id in the vehicle's software; may be empty
  std::string words;                   ///< kind of the sensor, and the evidence for it
  bool is_guess = false;               ///< known by the numbers alone
};

/// Reads a mapping of columns: {"format": "axiscal-log", "version": 1, "names": [..],
/// "columns": {"x": "acc_x", "y": {"column": "acc_y", "factor": -9.81}}}.
/// @throws DataError  `PATH: /json/pointer: ...`.
[[nodiscard]] LogFormat read_log_format(const std::string& path);

/// Samples, a column for each quantity, all of one length.
using LogBlock = std::vector<std::vector<double>>;

/// @param first, second, third  columns of samples.
/// @return the unit in which the length of three columns is gravity's: m/s^2, g or mg; empty if it
/// is
///         none.
[[nodiscard]] std::string unit_of_gravity(const std::vector<double>& first,
                                          const std::vector<double>& second,
                                          const std::vector<double>& third);

/// @return the position of a column among others, or nullopt.
[[nodiscard]] std::optional<std::size_t> find_column(const std::vector<std::string>& columns,
                                                     const std::string& name);

/// @param path  of the log, for the message.
/// @return the position of a column.
/// @throws DataError  if there is none of that name; the message lists those that there are.
[[nodiscard]] std::size_t need_column(const std::string& path,
                                      const std::vector<std::string>& columns,
                                      const std::string& name);

/// Defects of a log.
struct LogDefects {
  std::size_t ragged_rows = 0;  ///< left out: another number of cells than the first
  std::size_t first_ragged_line = 0;
  std::size_t missing_numbers = 0;  ///< cells that are not finite numbers; they read as NaN
  std::size_t first_missing_line = 0;
};

/// A raw recording, read block by block in constant memory.
///
/// Text: comma, semicolon, tab or blanks as separator, decimal point or comma, with or without a
/// header; lines before it are skipped; `#`, `%` and `//` begin comments; UTF-8, UTF-16 or Latin-1.
/// Compressed by gz, bz2, xz, zst, lz4; in a zip. NumPy's .npy and .npz, MATLAB's .mat (v5, v7.3),
/// spreadsheets (.xlsx) and JSON; their columns are held in memory. Flight logs, bags and phones'
/// recordings (RecordingFile): their sensors become the columns ax, ay, az, gx, ..., mx, ...,
/// temperature after time_s, at the times of the fastest accelerometer or gyroscope; the others are
/// interpolated. The format follows from the content of the file, not from its name; `-` is
/// standard input.
class LogFile {
 public:
  /// @throws DataError  if there is no such file, it is empty or damaged, or no table and no sensor
  /// is in it; the message says what is.
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

  /// The sensors among its columns, by the format, or the names and units of the columns, or their
  /// numbers. To be asked before select().
  [[nodiscard]] std::vector<LogSensor> sensors();

  /// The column of times: by its name, else by its cells, which are times of day or dates, or
  /// ascend evenly. To be asked before select().
  /// @return its name; empty where there is none.
  [[nodiscard]] std::string time_column();

  /// @return true if a column of the file has this name but is not a column of the log, because it
  ///         does not hold numbers.
  [[nodiscard]] bool has_text_column(const std::string& name) const;

  /// @return samples per second if the file states the rate and lacks times; otherwise nullopt.
  [[nodiscard]] std::optional<double> stated_rate_hz() const;

  /// @return "ulog", "table", ...; empty for samples from memory.
  [[nodiscard]] const std::string& format() const { return format_; }

  /// @return true if the file is a table; false for a table made of a recording's series.
  [[nodiscard]] bool is_table() const { return is_table_; }

  /// From now on read() gives these columns only, in this order.
  void select(std::vector<std::size_t> columns);

  /// Reads the next samples into a block.
  ///
  /// @param block overwritten: a column for each that is selected.
  /// @param most   largest number of samples; a file with thousands of columns gives fewer.
  /// @return the number of rows; 0 at the end.
  /// @throws DataError  if the file is damaged from here on (a truncated .gz, say).
  [[nodiscard]] std::size_t read(LogBlock& block, std::size_t most);

  [[nodiscard]] const LogDefects& defects() const;

  /// @return notes about the format: "separator ';', decimal comma", ...
  [[nodiscard]] const std::vector<std::string>& notes() const;

  [[nodiscard]] const std::string& path() const;

  class Source;

 private:
  void select_all();
  void look_ahead();
  void scale(LogBlock& block) const;
  static std::size_t rows_at_once(std::size_t columns);

  std::unique_ptr<Source> source_;
  std::vector<std::string> columns_;
  std::vector<double> factors_;   // factor of every column
  std::vector<int> signed_bits_;  // of columns of signed counts that were printed unsigned; else 0
  std::vector<std::size_t> places_;  // of every column in the source
  std::vector<std::size_t> selected_;
  LogBlock ahead_;  // rows that were read to see what the columns are
  std::size_t ahead_given_ = 0;
  std::vector<LogSensor> sensors_;  // where the format knows them
  int instance_ = 0;
  bool is_table_ = true;
  std::string format_, table_name_;
  std::string path_;
};

/// Reads a whole log.
[[nodiscard]] LogBlock read_log(LogFile& log);

}  // namespace axiscal
