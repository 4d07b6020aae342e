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

/// The kind of sensor or quantity that a series contains.
enum class SeriesKind { accelerometer, gyroscope, magnetometer, temperature, other };

/// @return the name of the kind: "accelerometer", "gyroscope", ...
[[nodiscard]] std::string_view name_of(SeriesKind kind);

/// The evidence for the kind of a series.
enum class KnownBy {
  format,  ///< the file's format states the kind
  names,   ///< the names of the columns show the kind
  units,   ///< the units in the header show the kind
  data,    ///< the values show the kind, for example by the constant magnitude of gravity
  nothing  ///< the kind is not known
};

/// A sequence of samples. Each sample has a time, and one number for each column. A series contains
/// either all numbers of a message or only the numbers of one sensor.
struct Series {
  std::string name;  ///< name of the message, topic or table in the file
  int instance = 0;  ///< number that distinguishes series of the same name
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

  /// Receives one sample.
  /// @param series  number of the series to which the sample belongs.
  /// @param time_s  time of the sample by the file's clock [s]; NaN if the file contains no times.
  /// @param values  one value for each column of the series; NaN if it is missing or invalid.
  virtual void sample(std::size_t series, double time_s, std::span<const double> values) = 0;
};

/// A file of numbers over time in any known format: a table, a flight log, a ROS bag, or a phone's
/// recording.
///
/// The content of the file determines its format; the file's name does not. The file may be
/// compressed. Records are decoded one by one in constant memory. Damaged parts are counted and
/// skipped.
class RecordingFile {
 public:
  /// @param path  path of a file, or of a folder that contains one bag of ROS 2 or tables (.csv);
  ///              `-` is standard input.
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

  /// @return notes on the damaged or skipped parts that have been found so far.
  [[nodiscard]] std::vector<std::string> notes() const;

  /// @return the parameters of the vehicle and the serial numbers that have been read so far, by
  ///         their names; for example "CAL_ACC0_ID" has the value "2424842".
  [[nodiscard]] const std::map<std::string, std::string>& facts() const;

  [[nodiscard]] const std::string& path() const { return path_; }

  class Decoder;

 private:
  std::string path_;
  std::unique_ptr<Decoder> decoder_;
};

/// Reads ROS message definitions from a folder. They are needed for bags that contain no
/// definitions (a .db3 of ROS 2 before Iron). The files are package/msg/Type.msg, as in the source
/// or share folder of a workspace. The definitions apply to all recordings that this program opens
/// afterwards. Do not call this function while other threads read recordings.
/// @return the number of definitions in the folder.
/// @throws DataError  if there is no such folder, or it contains no definition.
std::size_t add_message_definitions(const std::string& folder);

/// Statistics of a series.
struct SeriesSummary {
  Series series;
  std::size_t samples = 0;
  double start_s = 0.0;  ///< time of the first sample by the file's clock; NaN without times
  double end_s = 0.0;    ///< time of the last sample, by the same clock
  double rate_hz = 0.0;  ///< (samples - 1) / (end_s - start_s); NaN if not known
  std::size_t gaps = 0;  ///< time steps that are negative or longer than 5 usual steps
  std::vector<double> mean, sd;      ///< mean and standard deviation of each column, ignoring NaN
  std::vector<std::size_t> missing;  ///< number of NaN values in each column
  /// Start and end of the longest rest of an accelerometer [s after the first sample]; both are 0
  /// if there is no rest. At rest, the standard deviation of each axis over half a second is below
  /// 0.08 m/s^2.
  double still_from_s = 0.0, still_to_s = 0.0;
};

/// Statistics of all series of a recording.
struct RecordingSummary {
  std::string format;
  std::vector<SeriesSummary> series;  ///< in the file's order
  std::vector<std::string> notes;
  std::map<std::string, std::string> facts;
};

/// Summarises a recording. The memory use does not depend on the length of the recording.
/// @param most_samples  total number of samples, over all series, after which reading stops; if it
///                      is nullopt, the whole recording is read.
/// @throws DataError  if RecordingFile cannot open or read the file.
[[nodiscard]] RecordingSummary summarise(const std::string& path,
                                         std::optional<std::size_t> most_samples = {},
                                         const ReadLimits& limits = {});

/// @return the summary as JSON: {"format": .., "series": [{"name", "instance", "kind", "columns",
///         "unit", "samples", "start_s", "end_s", "rate_hz", "mean", "sd"}]}.
[[nodiscard]] std::string recording_json(const RecordingSummary& summary);

}  // namespace axiscal
