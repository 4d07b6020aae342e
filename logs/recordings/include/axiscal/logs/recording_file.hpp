// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/core/version.hpp"
#include "axiscal/logs/read_limits.hpp"

namespace axiscal {

/// The quantity of a series.
enum class SeriesKind { accelerometer, gyroscope, magnetometer, temperature, other };

/// @return "accelerometer", ...
[[nodiscard]] std::string_view name_of(SeriesKind kind);

/// The evidence for the kind of a series.
enum class KnownBy {
  format,  ///< by the file's format
  names,   ///< by the names of its columns
  units,   ///< by the units in its header
  data,    ///< by its numbers: the length of gravity, rates that match turns
  nothing  ///< the kind is not known
};

/// Numbers with common sample times: all numbers of a message, or those of one sensor in it.
struct Series {
  std::string name;  ///< name of the message, topic or table in the file
  int instance = 0;  ///< number among several of the same name
  SeriesKind kind = SeriesKind::other;
  std::vector<std::string> columns;  ///< names in the format: "AccX", "linear_acceleration.x"
  std::string unit;                  ///< unit of all columns; empty if not known
  KnownBy known_by = KnownBy::nothing;
};

/// Receives the samples of a recording as they are decoded.
class SeriesSink {
 public:
  SeriesSink() = default;
  SeriesSink(const SeriesSink&) = delete;
  SeriesSink& operator=(const SeriesSink&) = delete;
  virtual ~SeriesSink() = default;

  /// Announces a new series. Series are numbered from 0 in the order of these calls.
  virtual void add(const Series& series) = 0;

  /// One sample.
  /// @param series  number of its series.
  /// @param time_s  by the file's clock [s]; NaN if the file contains no times.
  /// @param values  one for each column; NaN if a value is missing or invalid.
  virtual void sample(std::size_t series, double time_s, std::span<const double> values) = 0;
};

/// A file of numbers over time in any known format: a table, a flight log, a bag, or a phone's
/// recording.
///
/// The content of the file determines its format; the file's name does not. The file may be
/// compressed. Records are decoded one by one in constant memory. Damaged parts are counted and
/// skipped.
class RecordingFile {
 public:
  /// @param path  `-` is standard input. A folder must contain one bag of ROS 2, or tables (.csv).
  /// @throws DataError  if there is no such file, it is empty, or its format is not known.
  explicit RecordingFile(const std::string& path, const ReadLimits& limits = {});
  ~RecordingFile();
  RecordingFile(RecordingFile&&) noexcept;
  RecordingFile& operator=(RecordingFile&&) noexcept;

  /// @return "ulog", "dataflash", "rosbag1", "table", ...
  [[nodiscard]] const std::string& format() const;

  /// Decodes the next records.
  /// @return false at the end.
  /// @throws DataError  if nothing more can be read.
  [[nodiscard]] bool read(SeriesSink& sink);

  /// @return notes on the damaged or skipped parts so far.
  [[nodiscard]] std::vector<std::string> notes() const;

  /// @return parameters and serial numbers of the devices in the file so far, for example
  ///         "CAL_ACC0_ID" = "2424842", or "device_id accelerometer 0".
  [[nodiscard]] const std::map<std::string, std::string>& facts() const;

  [[nodiscard]] const std::string& path() const { return path_; }

  class Decoder;

 private:
  std::string path_;
  std::unique_ptr<Decoder> decoder_;
};

/// Reads ROS message definitions from a folder, for bags that do not contain them (a .db3 of ROS 2
/// before Iron). The files are package/msg/Type.msg, as in the source or share folder of a
/// workspace. The definitions apply to all recordings that this program opens afterwards. Do not
/// call this function while other threads read recordings.
/// @return the number of definitions in the folder.
/// @throws DataError  if there is no such folder, or it contains no definition.
std::size_t add_message_definitions(const std::string& folder);

/// The content of a series.
struct SeriesSummary {
  Series series;
  std::size_t samples = 0;
  double start_s = 0.0;  ///< time of the first sample by the file's clock; NaN without times
  double end_s = 0.0;    ///< time of the last sample
  double rate_hz = 0.0;  ///< (samples - 1) / (end_s - start_s); NaN if not known
  std::size_t gaps = 0;  ///< number of steps of more than five times the usual one, or backwards
  std::vector<double> mean, sd;      ///< of each column, without NaN
  std::vector<std::size_t> missing;  ///< number of NaN in each column
  /// For an accelerometer: the longest series of half seconds in which no axis has a standard
  /// deviation of 0.08 m/s^2 or more, in seconds after the first sample; both 0 if there is none.
  double still_from_s = 0.0, still_to_s = 0.0;
};

/// The content of a recording.
struct RecordingSummary {
  std::string format;
  std::vector<SeriesSummary> series;  ///< in the file's order
  std::vector<std::string> notes;
  std::map<std::string, std::string> facts;
};

/// Summarises a recording in constant memory.
/// @param most_samples  number of samples of all series together; of a longer recording, only the
///                      first samples are read.
/// @throws DataError  as RecordingFile.
[[nodiscard]] RecordingSummary summarise(const std::string& path,
                                         std::optional<std::size_t> most_samples = {},
                                         const ReadLimits& limits = {});

/// @return the summary as JSON: {"format": .., "series": [{"name", "instance", "kind", "columns",
///         "unit", "samples", "start_s", "end_s", "rate_hz", "mean", "sd"}]}.
[[nodiscard]] std::string recording_json(const RecordingSummary& summary);

}  // namespace axiscal
