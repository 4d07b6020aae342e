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

/// One format of recordings. A decoder parses and passes samples on; it does not store them.
class RecordingFile::Decoder {
 public:
  Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  virtual ~Decoder() = default;

  /// Decodes the next record or block.
  /// @return false at the end.
  [[nodiscard]] virtual bool read(SeriesSink& sink) = 0;

  /// The damaged or skipped parts so far.
  [[nodiscard]] virtual std::vector<std::string> notes() const { return notes_; }

  std::string format;
  std::map<std::string, std::string> facts;
  std::shared_ptr<void> keep;  ///< an object that must live as long: a copy of the file

 protected:
  std::vector<std::string> notes_;
};

/// Parts of one message that are of different kinds, each a series of its own.
///
/// Neighbouring columns of one kind and unit form one series. A column without a rule is `other`.
class MessageSeries {
 public:
  struct Part {
    Series series;
    std::vector<std::size_t> places;  ///< of its columns in the message
    std::size_t number = 0;           ///< identifier in the sink
  };

  /// The kind of a column, or `other`.
  using Rule = std::function<Series(const std::string& column)>;

  MessageSeries() = default;

  /// @param name      of the message.
  /// @param columns   all of its numbers but its time.
  /// @param rule      states kind, unit and known_by of a column.
  MessageSeries(const std::string& name,
                int instance,
                const std::vector<std::string>& columns,
                const Rule& rule);

  /// @param of_columns  kind, unit and known_by of each column.
  MessageSeries(const std::string& name,
                int instance,
                const std::vector<std::string>& columns,
                const std::vector<Series>& of_columns);

  /// Makes its series known to a sink.
  /// @param count  of the series so far; counted on.
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
/// @param path  of a file that SQLite can open.
/// @param name  for messages.
[[nodiscard]] DecoderPointer open_rosbag2(const std::string& path,
                                          const std::string& name,
                                          const ReadBudget& budget);

/// True if the first lines of a text are of that format.
[[nodiscard]] bool is_dataflash_text(std::string_view start);
[[nodiscard]] bool is_mavlink_text(std::string_view start);
[[nodiscard]] bool is_vectornav(std::string_view start);
[[nodiscard]] bool is_motioncal(std::string_view start);
[[nodiscard]] bool is_tlog(std::string_view start);
[[nodiscard]] bool is_blackbox(std::string_view start);

}  // namespace axiscal
