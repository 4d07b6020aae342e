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
  format,  ///< the file's format says so
  names,   ///< by the names of its columns
  units,   ///< by the units in its header
  data,    ///< by its numbers: gravity's length, rates that are turns
  nothing  ///< it is not
};

/// Numbers with common sample times: a message, or one sensor's part of a message.
struct Series {
  std::string name;  ///< of the message, topic or table, as the file has it
  int instance = 0;  ///< of several of one name
  SeriesKind kind = SeriesKind::other;
  std::vector<std::string> columns;  ///< as the format calls them: "AccX", "linear_acceleration.x"
  std::string unit;                  ///< of all columns; empty: not known
  KnownBy known_by = KnownBy::nothing;
};

/// Takes the samples of a recording as they are decoded.
class SeriesSink {
 public:
  SeriesSink() = default;
  SeriesSink(const SeriesSink&) = delete;
  SeriesSink& operator=(const SeriesSink&) = delete;
  virtual ~SeriesSink() = default;

  /// A series that was met for the first time; they are counted from 0.
  virtual void add(const Series& series) = 0;

  /// One sample.
  /// @param series  its number.
  /// @param time_s  by the file's clock [s]; NaN where the file has none.
  /// @param values  one for each column; NaN if a value is missing or invalid.
  virtual void sample(std::size_t series, double time_s, std::span<const double> values) = 0;
};

/// A file of numbers over time, of any format that is known: tables, flight logs, bags, phones'.
///
/// The format follows from the content of the file, not from its name; the file may be compressed.
/// Records are decoded one by one in constant memory. Damaged parts are counted and skipped.
class RecordingFile {
 public:
  /// @param path  `-` is standard input; a folder stands for the one bag in it.
  /// @throws DataError  if there is no such file, it is empty, or of no format that is known.
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

  /// @return the damaged or skipped parts so far.
  [[nodiscard]] std::vector<std::string> notes() const;

  /// @return the devices in the file so far: parameters and serial numbers, as "CAL_ACC0_ID" =
  ///         "2424842", "device_id accelerometer 0".
  [[nodiscard]] const std::map<std::string, std::string>& facts() const;

  [[nodiscard]] const std::string& path() const { return path_; }

  class Decoder;

 private:
  std::string path_;
  std::unique_ptr<Decoder> decoder_;
};

/// Takes ROS message definitions from a folder, for bags that lack their own (a .db3 of ROS 2
/// before Iron): package/msg/Type.msg, as in a workspace's source or share folder. They apply to
/// all recordings that this program opens afterwards. Do not call this while other threads read.
/// @return the number of definitions in the folder.
/// @throws DataError  if there is no such folder, or none is in it.
std::size_t add_message_definitions(const std::string& folder);

/// The content of a series.
struct SeriesSummary {
  Series series;
  std::size_t samples = 0;
  double start_s = 0.0;          ///< of the first sample, by the file's clock; NaN without times
  double end_s = 0.0;            ///< of the last
  double rate_hz = 0.0;          ///< samples less one over the span; NaN where it is not known
  std::size_t gaps = 0;          ///< steps of more than five times the mean one, or back
  std::vector<double> mean, sd;  ///< of each column; NaN left out
  std::vector<std::size_t> missing;  ///< number of NaN in each column
  /// Of an accelerometer: the longest row of half seconds in which no axis scatters by more than
  /// 0.08 m/s^2, from the first sample [s]; both 0 where there is none.
  double still_from_s = 0.0, still_to_s = 0.0;
};

/// The content of a recording.
struct RecordingSummary {
  std::string format;
  std::vector<SeriesSummary> series;  ///< in the file's order
  std::vector<std::string> notes;
  std::map<std::string, std::string> facts;
};

/// Reads a recording from end to end, in constant memory.
/// @param most_samples  of all series together; the summary of a larger recording covers the first
///                      samples.
/// @throws DataError  as RecordingFile.
[[nodiscard]] RecordingSummary summarise(const std::string& path,
                                         std::optional<std::size_t> most_samples = {},
                                         const ReadLimits& limits = {});

/// @return the summary as JSON: {"format": .., "series": [{"name", "instance", "kind", "columns",
///         "unit", "samples", "start_s", "end_s", "rate_hz", "mean", "sd"}]}.
[[nodiscard]] std::string recording_json(const RecordingSummary& summary);

}  // namespace axiscal
