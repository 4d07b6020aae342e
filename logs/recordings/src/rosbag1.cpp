// SPDX-License-Identifier: Apache-2.0
// ROS 1 bags, format 2.0 (wiki.ros.org/Bags/Format/2.0). Each record consists of data and a header
// with fields name=value. Records of the type chunk contain further records. The file is read from
// its start to its end, and its index is ignored.
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

constexpr std::string_view magic = "#ROSBAG V2.0\n";
constexpr std::size_t longest_header = 1U << 20U;
constexpr std::size_t longest_data = 1U << 30U;

enum Operation : unsigned char {
  message_data = 2,
  bag_header = 3,
  index_data = 4,
  chunk = 5,
  chunk_info = 6,
  connection = 7
};

// Parses name=value fields; the length of each field precedes it.
std::map<std::string, std::string_view, std::less<>> fields_of(std::string_view header) {
  std::map<std::string, std::string_view, std::less<>> fields;
  RecordBytes bytes(header);
  while (bytes.left() > 0) {
    const std::string_view field = bytes.text(bytes.take<std::uint32_t>());
    const std::size_t equals = field.find('=');
    if (!bytes.ok() || equals == std::string_view::npos) {
      break;
    }
    fields.emplace(field.substr(0, equals), field.substr(equals + 1));
  }
  return fields;
}

class Rosbag1 final : public RecordingFile::Decoder {
 public:
  explicit Rosbag1(ByteSource bytes) : stream_(std::move(bytes)) {
    format = "rosbag1";
    static_cast<void>(stream_.take(magic.size()));
  }

  bool read(SeriesSink& sink) override {
    RecordBytes length(stream_.take(4));
    const std::size_t header_size = length.take<std::uint32_t>();
    if (!length.ok()) {
      return false;
    }
    if (header_size > longest_header) {
      is_damaged_ = true;
      return false;
    }
    const std::string header(stream_.take(header_size));
    RecordBytes data_length(stream_.take(4));
    const std::size_t data_size = data_length.take<std::uint32_t>();
    if (header.size() < header_size || !data_length.ok()) {
      is_cut_ = true;
      return false;
    }
    const auto fields = fields_of(header);
    const auto operation = fields.find("op");
    const unsigned char what = operation == fields.end() || operation->second.empty()
                                   ? 0
                                   : static_cast<unsigned char>(operation->second.front());
    if (what != chunk && what != connection && what != message_data) {
      is_cut_ = stream_.skip(data_size) < data_size;
      return !is_cut_;
    }
    if (data_size > longest_data) {
      is_damaged_ = true;
      return false;
    }
    const std::string_view data = stream_.take(data_size);
    if (data.size() < data_size) {
      is_cut_ = true;
    }
    if (what == chunk) {
      take_chunk(fields, data, sink);
    } else if (!is_cut_) {
      take_record(what, fields, data, sink);
    }
    return !is_cut_;
  }

  std::vector<std::string> notes() const override {
    std::vector<const RosTopic*> topics;
    for (const auto& [id, topic] : topics_) {
      topics.push_back(&topic);
    }
    std::vector<std::string> all = notes_of(topics);
    if (damaged_chunks_ > 0) {
      all.push_back(formatted("{} chunks are damaged and were left out", damaged_chunks_));
    }
    if (is_cut_) {
      all.emplace_back("the bag is cut short");
    }
    if (is_damaged_) {
      all.push_back(formatted("the bag is damaged from byte {} on", stream_.position()));
    }
    return all;
  }

 private:
  using Fields = std::map<std::string, std::string_view, std::less<>>;

  static std::string_view field(const Fields& fields, std::string_view name) {
    const auto found = fields.find(name);
    return found == fields.end() ? std::string_view() : found->second;
  }

  void take_chunk(const Fields& fields, std::string_view data, SeriesSink& sink) {
    const std::string_view packing = field(fields, "compression");
    std::optional<std::string> unpacked;
    if (packing != "none" && !packing.empty()) {
      RecordBytes size(field(fields, "size"));
      try {
        unpacked = unpack(packing == "bz2" ? "bzip2" : packing, data, size.take<std::uint32_t>(),
                          stream_.budget());
      } catch (const DataError&) {
        throw;
      } catch (const Error& error) {
        throw DataError(stream_.path(), error.what());
      }
      if (!unpacked) {
        ++damaged_chunks_;
        return;
      }
      data = *unpacked;
    }
    RecordBytes records(data);
    while (records.left() > 0) {
      const auto header = fields_of(records.text(records.take<std::uint32_t>()));
      const std::string_view record = records.text(records.take<std::uint32_t>());
      if (!records.ok()) {
        damaged_chunks_ += is_cut_ ? 0U : 1U;
        return;
      }
      const std::string_view operation = field(header, "op");
      take_record(operation.empty() ? 0 : static_cast<unsigned char>(operation.front()), header,
                  record, sink);
    }
  }

  void take_record(unsigned char what,
                   const Fields& header,
                   std::string_view data,
                   SeriesSink& sink) {
    RecordBytes number(field(header, "conn"));
    const auto id = number.take<std::uint32_t>();
    if (!number.ok()) {
      return;
    }
    if (what == connection) {
      const auto fields = fields_of(data);
      if (!topics_.contains(id) && topics_.size() < 4096) {
        topics_.emplace(
            id, RosTopic(std::string(field(header, "topic")), std::string(field(fields, "type")),
                         field(fields, "message_definition"), stream_.budget()));
      }
    } else if (what == message_data) {
      const auto topic = topics_.find(id);
      if (topic != topics_.end()) {
        RecordBytes time(field(header, "time"));
        const double seconds = time.take<std::uint32_t>();
        const double nanoseconds = time.take<std::uint32_t>();
        topic->second.put(sink, data, RosWire::packed, seconds + 1e-9 * nanoseconds, count_);
      }
    }
  }

  RecordStream stream_;
  std::map<std::uint32_t, RosTopic> topics_;
  std::size_t count_ = 0, damaged_chunks_ = 0;
  bool is_cut_ = false, is_damaged_ = false;
};

}  // namespace

DecoderPointer open_rosbag1(ByteSource bytes) {
  return std::make_unique<Rosbag1>(std::move(bytes));
}

}  // namespace axiscal
