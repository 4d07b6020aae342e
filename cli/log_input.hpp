// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/logs/imu.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/segment.hpp"
#include "option_set.hpp"
#include "table_options.hpp"

namespace axiscal::cli {

/// The options for reading a raw log, with unparsed values.
struct LogOptions {
  TableOptions table;
  std::optional<std::string> rate, instance;
};

/// The options for finding the periods at rest in a raw log, with unparsed values.
struct RestOptions {
  LogOptions log;
  std::optional<std::string> window, shortest, trim, threshold, range;
  std::optional<std::string> plan, regions;
  std::optional<std::string> columns, first_fence;
  std::optional<std::string> accelerometer, gyroscope, magnetometer, gyroscope_scale;
};

void add_log_options(OptionSet& options, LogOptions& log);

/// The options that state the units of columns without a unit in the header, with unparsed values.
struct UnitOptions {
  std::optional<std::string> all, accelerometer, gyroscope, magnetometer;
};

void add_unit_options(OptionSet& options, UnitOptions& units);

/// Adds the options of RestOptions, including those of its log.
void add_rest_options(OptionSet& options, RestOptions& rests);

/// @return the names of those options of `rests` that the command line contains.
[[nodiscard]] std::vector<std::string> stated_options_of(const RestOptions& rests);

/// @return the parts of a list such as "a,b,c".
[[nodiscard]] std::vector<std::string> names_of(const std::string& text);

/// @return the format of the log according to the options.
/// @param wanted  columns that the other options name.
[[nodiscard]] LogFormat format_of(const LogOptions& options,
                                  const std::vector<std::string>& wanted = {});

/// @return the columns whose names are given with --columns, --accelerometer and similar options.
[[nodiscard]] std::vector<std::string> columns_named_by(const RestOptions& options);

/// @return the options of segment(). The list of columns is empty unless --columns is given.
[[nodiscard]] SegmentOptions segment_options_of(const RestOptions& options);

/// @return the options of calibrate_imu() for columns, rests, run sheet and rotations.
/// @param accelerometer  columns of the accelerometer, used unless --accelerometer names others.
[[nodiscard]] ImuOptions imu_options_of(const RestOptions& options,
                                        const std::vector<std::string>& accelerometer);

/// A log in memory, and its sensors.
struct LogInput {
  RecordedLog log;
  std::vector<LogSensor> sensors;
  std::optional<double> stated_rate_hz;  ///< stated sample rate [Hz]; nullopt: the log has times
  bool has_parts = false;                ///< true if a column `part` contains words
  std::string time;                      ///< name of the column of times; empty if unknown
  std::vector<std::size_t> begins;       ///< first samples of the second and later files

  /// @return the sensor of a kind; null if the log has none.
  [[nodiscard]] const LogSensor* sensor(SeriesKind kind) const;
};

/// Reads a whole log into memory.
[[nodiscard]] LogInput record_log(const std::string& path, const LogFormat& format);
[[nodiscard]] LogInput record_log(LogFile file);

/// Reads several logs and joins them. The times of each further file are shifted, so that it
/// follows the file before it.
/// @throws DataError  if the columns of a file differ from those of the first file.
[[nodiscard]] LogInput record_logs(const std::vector<std::string>& paths, const LogFormat& format);

/// Prints to stderr the notes in `rests` and in `more_notes`, then the warnings in `rests` and the
/// messages in `labels`, unless `labels` is null.
void print_remarks_of(const Segmentation& rests,
                      const std::vector<std::string>& more_notes,
                      const SeatLabels* labels);

}  // namespace axiscal::cli
