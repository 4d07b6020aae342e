// SPDX-License-Identifier: Apache-2.0
// MCAP (mcap.dev/spec). Each record consists of an opcode, a length and data. Records of the type
// chunk contain further records. The file is read from its start to its end, and its index is
// ignored.
#include <map>
#include <optional>
#include <string>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/record_bytes.hpp"
#include "logs/recordings/src/ros_message.hpp"
#include "logs/recordings/src/unpacker.hpp"

namespace axiscal {
namespace {

constexpr std::size_t magic_size = 8;
constexpr std::uint64_t longest_record = 1U << 30U;

enum Operation : std::uint8_t { schema = 3, channel = 4, message = 5, chunk = 6, data_end = 15 };

class Mcap final : public RecordingFile::Decoder {
 public:
  explicit Mcap(ByteSource bytes) : stream_(std::move(bytes)) {
    format = "mcap";
    static_cast<void>(stream_.take(magic_size));
  }

  bool read(SeriesSink& sink) override {
    constexpr std::size_t head_size = 9;
    RecordBytes head(stream_.take(head_size));
    const auto what = head.take<std::uint8_t>();
    const auto size = head.take<std::uint64_t>();
    if (!head.ok() || what == data_end) {
      is_cut_ = !head.ok();
      return false;
    }
    if (what != schema && what != channel && what != message && what != chunk) {
      is_cut_ = stream_.skip(size) < size;
      return !is_cut_;
    }
    if (size > longest_record) {
      is_damaged_ = true;
      return false;
    }
    const std::string_view data = stream_.take(static_cast<std::size_t>(size));
    is_cut_ = data.size() < size;
    if (what == chunk) {
      take_chunk(data, sink);
    } else if (!is_cut_) {
      take_record(what, data, sink);
    }
    return !is_cut_;
  }

  std::vector<std::string> notes() const override {
    std::vector<const RosTopic*> topics;
    for (const auto& [id, channel_of_id] : channels_) {
      topics.push_back(&channel_of_id.topic);
    }
    std::vector<std::string> all = notes_of(topics);
    if (damaged_chunks_ > 0) {
      all.push_back(formatted("{} chunks are damaged and were left out", damaged_chunks_));
    }
    if (is_cut_) {
      all.emplace_back("the file is cut short");
    }
    if (is_damaged_) {
      all.push_back(formatted("the file is damaged from byte {} on", stream_.position()));
    }
    return all;
  }

 private:
  struct Schema {
    std::string name, encoding, text;
  };
  struct Channel {
    RosTopic topic;
    RosWire wire = RosWire::cdr;
  };

  static std::string_view text(RecordBytes& bytes) {
    return bytes.text(bytes.take<std::uint32_t>());
  }

  void take_chunk(std::string_view data, SeriesSink& sink) {
    RecordBytes bytes(data);
    bytes.skip(16);  // times of the first and the last message
    const auto size = bytes.take<std::uint64_t>();
    bytes.skip(4);  // checksum
    const std::string packing(text(bytes));
    const auto packed_size = bytes.take<std::uint64_t>();
    if (!bytes.ok() || size > longest_record) {
      ++damaged_chunks_;
      return;
    }
    std::string_view records =
        bytes.text(static_cast<std::size_t>(std::min<std::uint64_t>(packed_size, bytes.left())));
    std::optional<std::string> unpacked;
    if (!packing.empty()) {
      try {
        unpacked = unpack(packing, records, static_cast<std::size_t>(size), stream_.budget());
      } catch (const DataError&) {
        throw;
      } catch (const Error& error) {
        throw DataError(stream_.path(), error.what());
      }
      if (!unpacked) {
        ++damaged_chunks_;
        return;
      }
      records = *unpacked;
    }
    RecordBytes inside(records);
    while (inside.left() > 0) {
      const auto what = inside.take<std::uint8_t>();
      const auto record_size = inside.take<std::uint64_t>();
      if (!inside.ok() || record_size > inside.left()) {
        damaged_chunks_ += is_cut_ ? 0U : 1U;
        return;
      }
      take_record(what, inside.text(static_cast<std::size_t>(record_size)), sink);
    }
  }

  void take_record(std::uint8_t what, std::string_view data, SeriesSink& sink) {
    RecordBytes bytes(data);
    const auto id = bytes.take<std::uint16_t>();
    if (what == schema && schemas_.size() < 4096) {
      Schema& one = schemas_[id];
      one.name = text(bytes);
      one.encoding = text(bytes);
      one.text = text(bytes);
    } else if (what == channel && channels_.size() < 4096) {
      const auto schema_id = bytes.take<std::uint16_t>();
      const std::string topic(text(bytes));
      const std::string encoding(text(bytes));
      const auto found = schemas_.find(schema_id);
      const bool is_ros = encoding == "cdr" || encoding == "ros1";
      const bool has_text = found != schemas_.end() && (found->second.encoding == "ros2msg" ||
                                                        found->second.encoding == "ros1msg");
      if (bytes.ok() && !channels_.contains(id)) {
        const std::string name = found == schemas_.end() ? "" : found->second.name;
        channels_[id] = {
            .topic = RosTopic(topic, is_ros ? name : encoding,
                              has_text && is_ros ? std::string_view(found->second.text) : "",
                              stream_.budget()),
            .wire = encoding == "ros1" ? RosWire::packed : RosWire::cdr};
      }
    } else if (what == message) {
      bytes.skip(4);  // sequence
      const auto log_ns = bytes.take<std::uint64_t>();
      bytes.skip(8);  // time of publication
      const auto found = channels_.find(id);
      if (bytes.ok() && found != channels_.end()) {
        found->second.topic.put(sink, bytes.rest(), found->second.wire,
                                static_cast<double>(log_ns) * 1e-9, count_);
      }
    }
  }

  RecordStream stream_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::size_t count_ = 0, damaged_chunks_ = 0;
  bool is_cut_ = false, is_damaged_ = false;
};

}  // namespace

DecoderPointer open_mcap(ByteSource bytes) {
  return std::make_unique<Mcap>(std::move(bytes));
}

}  // namespace axiscal
