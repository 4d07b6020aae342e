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

/// Renames a column of a log to the name that a calibration uses, and scales its values.
struct MappedColumn {
  std::string name;     ///< name in the calibration
  std::string column;   ///< name in the log
  double factor = 1.0;  ///< -1 reverses the axis
  /// Function that converts the text of a cell, for example "X up" to "-X". If it is empty, cells
  /// stay unchanged. Only TableText uses it.
  std::function<std::string(const std::string& cell)> of_cell = {};
};

/// Options for reading a log; all have automatic defaults.
struct LogFormat {
  /// Names of the columns if the log lacks a header; default: c1, c2, ...
  std::vector<std::string> names;
  std::vector<MappedColumn> columns;  ///< columns to rename or scale; others stay unchanged
  /// Zero-based number of the sensor to read if a recording contains several sensors of one kind.
  int instance = 0;
  /// Kinds of sensors to read from a recording; if empty, all kinds are read. If only one kind is
  /// read, its samples are not interpolated.
  std::vector<SeriesKind> kinds;
  /// Further columns to read from a recording. Each entry is a name in the recording, such as
  /// "AccX", or this name with the name of its message in front, such as "IMU2.AccX".
  std::vector<std::string> wanted;
  ReadLimits limits;  ///< limits on the cost of reading the file
};

/// A sensor with three axes among the columns of a log.
struct LogSensor {
  SeriesKind kind = SeriesKind::other;
  std::array<std::string, 3> columns;  ///< names of the columns x, y, z in the log
  std::string unit;                    ///< empty if not known
  int number = 0;                      ///< zero-based index among the log's sensors of this kind
  int of = 1;                          ///< number of sensors of this kind in the recording
  std::string device;                  ///< device id from the log of PX4 or ArduPilot, or empty
  std::string words;                   ///< description: the kind, and how it was recognised
  bool is_guess = false;               ///< true if the kind was inferred from the values only
};

/// Reads the names and the mapping of columns from a JSON file: {"format": "axiscal-log",
/// "version": 1, "names": [..], "columns": {"x": "acc_x", "y": {"column": "acc_y", "factor":
/// -9.81}}}.
/// @throws DataError  with the message `PATH: /json/pointer: ...`.
[[nodiscard]] LogFormat read_log_format(const std::string& path);

/// A block of samples: one vector for each column, all of the same length.
using LogBlock = std::vector<std::vector<double>>;

/// @param first, second, third  columns of samples of the three axes of an accelerometer.
/// @return the unit (m/s^2, g or mg) in which the samples have the magnitude of gravity; empty if
///         there is no such unit.
[[nodiscard]] std::string unit_of_gravity(const std::vector<double>& first,
                                          const std::vector<double>& second,
                                          const std::vector<double>& third);

/// @return the index of the column `name`. If there is no such column, the index of the only column
///         whose name equals `name` apart from units, such as "ax (m/s^2)" for "ax". nullopt if
///         there is neither.
[[nodiscard]] std::optional<std::size_t> find_column(const std::vector<std::string>& columns,
                                                     const std::string& name);

/// @param path  path of the log, for the message.
/// @return the index of the column that find_column() finds.
/// @throws DataError  if there is no such column; the message lists the names of all columns.
[[nodiscard]] std::size_t need_column(const std::string& path,
                                      const std::vector<std::string>& columns,
                                      const std::string& name);

/// Defects of a log.
struct LogDefects {
  std::size_t ragged_rows = 0;  ///< number of skipped rows with a wrong number of cells
  std::size_t first_ragged_line = 0;
  std::size_t missing_numbers = 0;  ///< number of cells that are not finite numbers; read as NaN
  std::size_t first_missing_line = 0;
};

/// A raw recording, read block by block in constant memory.
///
/// In a text file, the separator is a comma, a semicolon, a tab or blanks. Numbers have a decimal
/// point or a decimal comma. The header may be missing, and lines before it are skipped. `#`, `%`
/// and `//` begin comments. The encoding is UTF-8, UTF-16 or Latin-1. The file may be compressed by
/// gz, bz2, xz, zst or lz4, or be in a zip archive. NumPy's .npy and .npz, MATLAB's .mat (v5,
/// v7.3), spreadsheets (.xlsx) and JSON are also read; their columns are held in memory.
///
/// A flight log, a ROS bag or a phone's recording (RecordingFile) becomes a table. Its columns are
/// time_s, ax, ay, az, gx, ..., mx, ... and temperature. Its rows are the samples of the fastest
/// accelerometer or gyroscope; the other sensors are interpolated to the times of these rows.
///
/// The content of the file determines its format; the file's name does not. `-` is standard input.
class LogFile {
 public:
  /// @throws DataError  if there is no such file, or it is empty or damaged, or it contains neither
  ///                    a table nor a sensor. In the last case the message lists its content.
  explicit LogFile(const std::string& path, const LogFormat& format = {});

  /// Makes a log from samples in memory.
  /// @param name     name of the log, for messages.
  /// @param columns  one name for each column.
  /// @param samples  the columns, all of the same length.
  LogFile(std::string name, std::vector<std::string> columns, LogBlock samples);

  ~LogFile();
  LogFile(LogFile&&) noexcept;
  LogFile& operator=(LogFile&&) noexcept;

  /// @return the names of the columns after mapping.
  [[nodiscard]] const std::vector<std::string>& columns() const;

  /// @return the index of the column; see need_column().
  [[nodiscard]] std::size_t need(const std::string& name) const;

  /// Finds the sensors among the columns, from the format of the file, from the names and units of
  /// the columns, or from their values. Must be called before select().
  [[nodiscard]] std::vector<LogSensor> sensors();

  /// Finds the column of times by its name. If no name is recognised, finds a column whose cells
  /// are times of day, dates, or numbers that ascend evenly. Must be called before select().
  /// @return the name of the column; empty if there is no such column.
  [[nodiscard]] std::string time_column();

  /// @return true if the file has a column of this name that contains no numbers and is therefore
  ///         not among columns().
  [[nodiscard]] bool has_text_column(const std::string& name) const;

  /// @return samples per second if the file states the rate and lacks times; otherwise nullopt.
  [[nodiscard]] std::optional<double> stated_rate_hz() const;

  /// @return "ulog", "table", ...; empty for samples from memory.
  [[nodiscard]] const std::string& format() const { return format_; }

  /// @return true if the file is itself a table; false if it is a recording of several series that
  ///         was converted to a table.
  [[nodiscard]] bool is_table() const { return is_table_; }

  /// Makes read() return only these columns, in this order.
  void select(std::vector<std::size_t> columns);

  /// Reads the next samples into a block.
  ///
  /// @param block  receives the selected columns.
  /// @param most   largest number of rows to read. Fewer rows are read at once if there are
  ///               thousands of columns.
  /// @return the number of rows; 0 at the end.
  /// @throws DataError  if the rest of the file is damaged, for example a truncated .gz.
  [[nodiscard]] std::size_t read(LogBlock& block, std::size_t most);

  [[nodiscard]] const LogDefects& defects() const;

  /// @return notes about the file's format, such as "separator ;, with decimal commas".
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
  std::vector<double> factors_;  // factor of every column
  // For each column, the width in bits of signed counts that were printed as unsigned numbers; 0
  // for other columns.
  std::vector<int> signed_bits_;
  std::vector<std::size_t> places_;  // index of every column in the source
  std::vector<std::size_t> selected_;
  LogBlock ahead_;  // first rows, read in advance to recognise the columns
  std::size_t ahead_given_ = 0;
  std::vector<LogSensor> sensors_;  // stated by the format, or recognised by sensors()
  int instance_ = 0;
  bool is_table_ = true;
  std::string format_, table_name_;
  std::string path_;
};

/// Reads a whole log.
[[nodiscard]] LogBlock read_log(LogFile& log);

}  // namespace axiscal
