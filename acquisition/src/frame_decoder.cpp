// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>

#include <boost/crc.hpp>

#include "acquisition/src/decoder.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

using Bytes = std::string_view;

struct NumberType {
  std::string_view name;
  std::size_t size;
  double (*value)(std::uint64_t bits);
};

template <typename Number, typename Bits>
double as(std::uint64_t bits) {
  return static_cast<double>(std::bit_cast<Number>(static_cast<Bits>(bits)));
}

double as_int24(std::uint64_t bits) {
  return static_cast<double>(static_cast<std::int32_t>(static_cast<std::uint32_t>(bits) << 8U) /
                             256);
}

constexpr std::array number_types = {
    NumberType{"int8", 1, as<std::int8_t, std::uint8_t>},
    NumberType{"uint8", 1, as<std::uint8_t, std::uint8_t>},
    NumberType{"int16", 2, as<std::int16_t, std::uint16_t>},
    NumberType{"uint16", 2, as<std::uint16_t, std::uint16_t>},
    NumberType{"int24", 3, as_int24},
    NumberType{"int32", 4, as<std::int32_t, std::uint32_t>},
    NumberType{"uint32", 4, as<std::uint32_t, std::uint32_t>},
    NumberType{"int64", 8, as<std::int64_t, std::uint64_t>},
    NumberType{"uint64", 8, as<std::uint64_t, std::uint64_t>},
    NumberType{"float32", 4, as<float, std::uint32_t>},
    NumberType{"float64", 8, as<double, std::uint64_t>},
};

template <typename Crc>
std::uint64_t crc(Bytes bytes) {
  Crc computer;
  computer.process_bytes(bytes.data(), bytes.size());
  return computer.checksum();
}

std::uint64_t sum(Bytes bytes) {
  std::uint64_t total = 0;
  for (const char byte : bytes) {
    total += static_cast<unsigned char>(byte);
  }
  return total;
}

std::uint64_t exclusive_or(Bytes bytes) {
  unsigned char total = 0;
  for (const char byte : bytes) {
    total = static_cast<unsigned char>(total ^ static_cast<unsigned char>(byte));
  }
  return total;
}

std::uint64_t fletcher16(Bytes bytes) {
  unsigned first = 0;
  unsigned second = 0;
  for (const char byte : bytes) {
    first = (first + static_cast<unsigned char>(byte)) % 255U;
    second = (second + first) % 255U;
  }
  return (second << 8U) | first;
}

struct ChecksumType {
  std::string_view name;
  std::size_t size;
  std::uint64_t (*of)(Bytes bytes);
};

using CrcModbus = boost::crc_optimal<16, 0x8005, 0xFFFF, 0, true, true>;
constexpr std::array checksum_types = {
    ChecksumType{"sum8", 1, sum},
    ChecksumType{"sum16", 2, sum},
    ChecksumType{"xor8", 1, exclusive_or},
    ChecksumType{"fletcher16", 2, fletcher16},
    ChecksumType{"crc16_ccitt", 2, crc<boost::crc_ccitt_false_t>},
    ChecksumType{"crc16_xmodem", 2, crc<boost::crc_xmodem_t>},
    ChecksumType{"crc16_modbus", 2, crc<CrcModbus>},
    ChecksumType{"crc32", 4, crc<boost::crc_32_type>},
};

template <typename Types>
const auto& find_type(const Types& types, const JsonValue& value) {
  const std::string name = value.text();
  std::vector<std::string_view> names;
  for (const auto& type : types) {
    if (type.name == name) {
      return type;
    }
    names.push_back(type.name);
  }
  value.fail(formatted("'{}' is not known{}", name, did_you_mean(name, names)));
}

struct Field {
  std::size_t offset = 0;
  const NumberType* type = nullptr;
  bool big_endian = false;
  double scale = 1.0;
  double add = 0.0;
};

struct Checksum {
  const ChecksumType* type = nullptr;
  std::size_t offset = 0;
  std::size_t from = 0;
  std::size_t to = 0;
  bool big_endian = false;
};

std::uint64_t bits_of(Bytes bytes, bool big_endian) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const std::size_t at = big_endian ? i : bytes.size() - 1 - i;
    bits = (bits << 8U) | static_cast<unsigned char>(bytes[at]);
  }
  return bits;
}

std::size_t place(const JsonValue& value, std::size_t size, std::size_t length) {
  const int offset = value.integer();
  if (offset < 0 || static_cast<std::size_t>(offset) + size > length) {
    value.fail(formatted("must lie within the {} bytes of the frame", length));
  }
  return static_cast<std::size_t>(offset);
}

std::string bytes_of_hex(const JsonValue& value) {
  const std::string text = value.text();
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    const std::string pair = text.substr(i, 2);
    char* end = nullptr;
    const unsigned long byte = std::strtoul(pair.c_str(), &end, 16);
    if (pair.size() != 2 || end != pair.c_str() + 2) {
      value.fail(formatted("'{}': expected pairs of hexadecimal digits, such as \"AA55\"", text));
    }
    bytes += static_cast<char>(byte);
  }
  return bytes;
}

class FrameDecoder final : public Decoder {
 public:
  explicit FrameDecoder(const std::string& path) {
    const JsonValue json = parse_json(read_whole_file(path), path);
    json.require_format("axiscal-frames");
    json.allow_keys(std::array<std::string_view, 7>{"format", "version", "length", "sync", "endian",
                                                    "fields", "checksum"});
    const JsonValue length = json.at("length");
    constexpr int longest_frame = 4096;
    if (length.integer() < 1 || length.integer() > longest_frame) {
      length.fail("expected 1 to 4096 bytes");
    }
    length_ = static_cast<std::size_t>(length.integer());
    if (const std::optional<JsonValue> sync = json.find("sync")) {
      sync_ = bytes_of_hex(*sync);
    }
    const bool big_endian = is_big_endian(json, false);
    for (const JsonValue& field : json.at("fields").elements()) {
      read_field(field, big_endian);
    }
    if (fields_.empty()) {
      json.at("fields").fail("must contain at least one field");
    }
    if (const std::optional<JsonValue> checksum = json.find("checksum")) {
      read_checksum(*checksum, big_endian);
    }
    if (sync_.empty() && !checksum_) {
      json.fail("\"sync\" or \"checksum\" is required to detect where a frame begins");
    }
  }

  void decode(std::string_view bytes, const DecoderSink& sink) override {
    held_.append(bytes);
    std::size_t at = 0;
    while (at + length_ <= held_.size()) {
      const Bytes frame = Bytes(held_).substr(at, length_);
      if (!is_good(frame)) {
        skipped_ = true;
        ++at;
        continue;
      }
      if (skipped_ && !midway_) {
        sink.defect();
      }
      skipped_ = false;
      midway_ = false;
      values_.clear();
      for (const Field& field : fields_) {
        const std::uint64_t bits =
            bits_of(frame.substr(field.offset, field.type->size), field.big_endian);
        values_.push_back(field.scale * field.type->value(bits) + field.add);
      }
      sink.sample(values_);
      at += length_;
    }
    held_.erase(0, at);
  }

  [[nodiscard]] bool is_text() const override { return false; }

  void restart(bool midway) override {
    held_.clear();
    midway_ = midway;
  }

 private:
  static bool is_big_endian(const JsonValue& json, bool otherwise) {
    const std::string text = json.text_or("endian", otherwise ? "big" : "little");
    if (text != "big" && text != "little") {
      json.at("endian").fail("expected \"little\" or \"big\"");
    }
    return text == "big";
  }

  void read_field(const JsonValue& json, bool big_endian) {
    json.allow_keys(std::array<std::string_view, 7>{"name", "offset", "type", "scale", "add",
                                                    "unit", "endian"});
    Field field{.type = &find_type(number_types, json.at("type"))};
    field.offset = place(json.at("offset"), field.type->size, length_);
    field.big_endian = is_big_endian(json, big_endian);
    if (const std::optional<JsonValue> scale = json.find("scale")) {
      field.scale = scale->number();
    }
    if (const std::optional<JsonValue> add = json.find("add")) {
      field.add = add->number();
    }
    fields_.push_back(field);
    channels_.push_back({.name = json.at("name").text(), .unit = json.text_or("unit")});
  }

  void read_checksum(const JsonValue& json, bool big_endian) {
    json.allow_keys(std::array<std::string_view, 5>{"type", "offset", "from", "to", "endian"});
    Checksum checksum{.type = &find_type(checksum_types, json.at("type"))};
    checksum.offset = place(json.at("offset"), checksum.type->size, length_);
    checksum.to = checksum.offset;
    if (const std::optional<JsonValue> from = json.find("from")) {
      checksum.from = place(*from, 0, length_);
    }
    if (const std::optional<JsonValue> to = json.find("to")) {
      checksum.to = place(*to, 0, length_);
    }
    if (checksum.to <= checksum.from) {
      json.fail("\"to\" must be larger than \"from\"");
    }
    checksum.big_endian = is_big_endian(json, big_endian);
    checksum_ = checksum;
  }

  bool is_good(Bytes frame) const {
    if (!frame.starts_with(sync_)) {
      return false;
    }
    if (!checksum_) {
      return true;
    }
    const std::size_t size = checksum_->type->size;
    const std::uint64_t mask = (1ULL << (8 * size)) - 1;
    const Bytes covered = frame.substr(checksum_->from, checksum_->to - checksum_->from);
    return (checksum_->type->of(covered) & mask) ==
           bits_of(frame.substr(checksum_->offset, size), checksum_->big_endian);
  }

  std::size_t length_ = 0;
  std::string sync_;
  std::vector<Field> fields_;
  std::optional<Checksum> checksum_;
  std::string held_;
  std::vector<double> values_;
  bool skipped_ = false;  // true if bytes were skipped since the last frame
  bool midway_ = false;   // true if the input may begin in the middle of a frame
};

}  // namespace

std::unique_ptr<Decoder> make_frame_decoder(const std::string& path) {
  return std::make_unique<FrameDecoder>(path);
}

}  // namespace axiscal
