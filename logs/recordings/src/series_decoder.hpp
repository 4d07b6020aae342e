// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "axiscal/logs/recording_file.hpp"
#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// Base class of the decoders of recordings; each format has its own decoder. A decoder passes
/// samples on, and does not store them.
class RecordingFile::Decoder {
 public:
  Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  virtual ~Decoder() = default;

  /// Decodes the next record or block.
  /// @return false at the end.
  [[nodiscard]] virtual bool read(SeriesSink& sink) = 0;

  /// @return notes on the damaged or skipped parts that have been found so far.
  [[nodiscard]] virtual std::vector<std::string> notes() const { return notes_; }

  std::string format;
  std::map<std::string, std::string> facts;
  std::shared_ptr<void> keep;  ///< owns the temporary copy that the decoder reads; may be null

 protected:
  std::vector<std::string> notes_;
};

/// Splits the numbers in messages of one type into series. Columns of the same kind and unit form
/// one series. A series of a sensor has at most three columns. Columns of unknown kind get the kind
/// `other`.
class MessageSeries {
 public:
  struct Part {
    Series series;
    std::vector<std::size_t> places;  ///< indices of the series' columns in the message
    std::size_t number = 0;           ///< index of the series in the sink
  };

  /// A function that returns the kind, unit and known_by of a column, as a Series. The kind may be
  /// `other`.
  using Rule = std::function<Series(const std::string& column)>;

  MessageSeries() = default;

  /// @param name      name of the message.
  /// @param instance  number that distinguishes messages of the same name.
  /// @param columns   names of all numbers in the message except the time.
  /// @param rule      gives kind, unit and known_by of a column.
  MessageSeries(const std::string& name,
                int instance,
                const std::vector<std::string>& columns,
                const Rule& rule);

  /// @param of_columns  a Series for each column. Only kind, unit and known_by are used.
  MessageSeries(const std::string& name,
                int instance,
                const std::vector<std::string>& columns,
                const std::vector<Series>& of_columns);

  /// Announces the series to a sink.
  /// @param count  number of series in the sink; increased by the number of these series.
  void announce(SeriesSink& sink, std::size_t& count);

  void put(SeriesSink& sink, double time_s, std::span<const double> message);

  [[nodiscard]] bool announced() const { return announced_; }
  [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }

 private:
  std::vector<Part> parts_;
  std::vector<double> values_;
  bool announced_ = false;
};

using DecoderPointer = std::unique_ptr<RecordingFile::Decoder>;

[[nodiscard]] DecoderPointer open_ulog(ByteSource bytes);
[[nodiscard]] DecoderPointer open_dataflash(ByteSource bytes);
[[nodiscard]] DecoderPointer open_dataflash_text(ByteSource bytes);
[[nodiscard]] DecoderPointer open_mavlink_text(ByteSource bytes);
[[nodiscard]] DecoderPointer open_tlog(ByteSource bytes);
[[nodiscard]] DecoderPointer open_blackbox(ByteSource bytes);
[[nodiscard]] DecoderPointer open_rosbag1(ByteSource bytes);
[[nodiscard]] DecoderPointer open_mcap(ByteSource bytes);
[[nodiscard]] DecoderPointer open_vectornav(ByteSource bytes);
[[nodiscard]] DecoderPointer open_motioncal(ByteSource bytes);
/// @param path  path of a file that SQLite can open.
/// @param name  name of the file, for messages.
[[nodiscard]] DecoderPointer open_rosbag2(const std::string& path,
                                          const std::string& name,
                                          const ReadBudget& budget);

/// @param start  the first bytes of a file.
/// @return true if the file has the format in the name of the function.
[[nodiscard]] bool is_dataflash_text(std::string_view start);
[[nodiscard]] bool is_mavlink_text(std::string_view start);
[[nodiscard]] bool is_vectornav(std::string_view start);
[[nodiscard]] bool is_motioncal(std::string_view start);
[[nodiscard]] bool is_tlog(std::string_view start);
[[nodiscard]] bool is_blackbox(std::string_view start);

}  // namespace axiscal
