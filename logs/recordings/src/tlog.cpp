// SPDX-License-Identifier: Apache-2.0
// Telemetry logs of ground stations. They consist of MAVLink packets (mavlink.io, "Packet
// Serialization", versions 1 and 2). Before each packet is its time in microseconds since 1970, as
// a big-endian integer.
#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/flight_messages.hpp"
#include "logs/recordings/src/record_bytes.hpp"

namespace axiscal {
namespace {

constexpr std::size_t time_size = 8;
constexpr std::uint8_t start_of_1 = 0xFE;
constexpr std::uint8_t start_of_2 = 0xFD;

// A message with readings of an inertial sensor, from the common message set of mavlink.io. The
// fields are in the order in which they are sent. checksum_extra is a byte that is appended to the
// message for the checksum.
struct KnownMessage {
  std::uint32_t id;
  const char* name;
  std::uint8_t checksum_extra;
  const char* letters;  // field types: Q uint64, I uint32, H uint16, h int16, B uint8, f float
  const char* fields;
};

constexpr std::array<KnownMessage, 5> known_messages = {{
    {26, "SCALED_IMU", 170, "Ihhhhhhhhhh",
     "time_boot_ms,xacc,yacc,zacc,xgyro,ygyro,zgyro,xmag,ymag,zmag,temperature"},
    {27, "RAW_IMU", 144, "QhhhhhhhhhBh",
     "time_usec,xacc,yacc,zacc,xgyro,ygyro,zgyro,xmag,ymag,zmag,id,temperature"},
    {105, "HIGHRES_IMU", 93, "QfffffffffffffHB",
     "time_usec,xacc,yacc,zacc,xgyro,ygyro,zgyro,xmag,ymag,zmag,abs_pressure,diff_pressure,"
     "pressure_alt,temperature,fields_updated,id"},
    {116, "SCALED_IMU2", 76, "Ihhhhhhhhhh",
     "time_boot_ms,xacc,yacc,zacc,xgyro,ygyro,zgyro,xmag,ymag,zmag,temperature"},
    {129, "SCALED_IMU3", 46, "Ihhhhhhhhhh",
     "time_boot_ms,xacc,yacc,zacc,xgyro,ygyro,zgyro,xmag,ymag,zmag,temperature"},
}};

// Computes the checksum CRC-16/MCRF4XX, which MAVLink uses.
std::uint16_t checksum(std::string_view bytes, std::uint8_t extra) {
  std::uint16_t crc = 0xFFFF;
  const auto add = [&](std::uint8_t byte) {
    auto x = static_cast<std::uint8_t>(byte ^ (crc & 0xFFU));
    x = static_cast<std::uint8_t>(x ^ static_cast<std::uint8_t>(x << 4U));
    crc = static_cast<std::uint16_t>((crc >> 8U) ^ (x << 8U) ^ (x << 3U) ^ (x >> 4U));
  };
  for (const char byte : bytes) {
    add(static_cast<std::uint8_t>(byte));
  }
  add(extra);
  return crc;
}

double big_endian_us(std::string_view bytes) {
  std::uint64_t us = 0;
  for (std::size_t i = 0; i < time_size; ++i) {
    us = us << 8U | static_cast<std::uint8_t>(bytes[i]);
  }
  return static_cast<double>(us);
}

// A packet, parsed from the bytes that follow its time stamp.
struct Packet {
  std::uint32_t id = 0;
  std::uint8_t system = 0;
  std::size_t size = 0;  // size of the packet in bytes
  std::string_view payload;
  std::string_view checked;  // the bytes that the checksum covers
  std::uint16_t crc = 0;
};

// @return the packet at the start of the bytes; nullopt if no complete packet starts there.
std::optional<Packet> packet_of(std::string_view bytes) {
  RecordBytes in(bytes);
  const std::uint8_t start = in.take<std::uint8_t>();
  if (start != start_of_1 && start != start_of_2) {
    return std::nullopt;
  }
  Packet packet;
  const std::size_t length = in.take<std::uint8_t>();
  bool is_signed = false;
  if (start == start_of_2) {
    is_signed = (in.take<std::uint8_t>() & 1U) != 0;
    in.skip(1);
  }
  in.skip(1);  // sequence
  packet.system = in.take<std::uint8_t>();
  in.skip(1);  // component
  packet.id = in.take<std::uint8_t>();
  if (start == start_of_2) {
    packet.id |= static_cast<std::uint32_t>(in.take<std::uint16_t>()) << 8U;
  }
  packet.payload = in.text(length);
  packet.checked = bytes.substr(1, in.at() > 1 ? in.at() - 1 : 0);
  packet.crc = in.take<std::uint16_t>();
  if (is_signed) {
    constexpr std::size_t signature = 13;
    in.skip(signature);
  }
  packet.size = in.at();
  return in.ok() ? std::optional(packet) : std::nullopt;
}

constexpr std::size_t longest_packet = 300;

class Tlog final : public RecordingFile::Decoder {
 public:
  explicit Tlog(ByteSource bytes) : stream_(std::move(bytes)) {
    format = "tlog";
    for (const KnownMessage& known : known_messages) {
      std::vector<std::string> fields;
      for (const std::string_view field : split(known.fields, ',')) {
        fields.emplace_back(field);
      }
      flights_.emplace_back(known.name, fields);
    }
  }

  bool read(SeriesSink& sink) override {
    const std::string_view ahead = stream_.peek(time_size + longest_packet);
    if (ahead.size() <= time_size) {
      lost_ += stream_.skip(ahead.size());
      return false;
    }
    const std::optional<Packet> packet = packet_of(ahead.substr(time_size));
    if (!packet) {
      lost_ += stream_.skip(1);
      return true;
    }
    const auto known =
        std::find_if(known_messages.begin(), known_messages.end(),
                     [&](const KnownMessage& message) { return message.id == packet->id; });
    if (known == known_messages.end()) {
      ++others_;
    } else if (checksum(packet->checked, known->checksum_extra) != packet->crc) {
      ++damaged_;
      lost_ += stream_.skip(1);
      return true;
    } else {
      take(*known, *packet, big_endian_us(ahead) * 1e-6, sink);
    }
    stream_.skip(time_size + packet->size);
    return true;
  }

  std::vector<std::string> notes() const override {
    std::vector<std::string> all;
    if (others_ > 0) {
      all.push_back(
          formatted("{} packets contain no data of inertial sensors and are left out", others_));
    }
    if (damaged_ > 0) {
      all.push_back(formatted("{} packets have a wrong checksum, and are left out", damaged_));
    }
    if (lost_ > 0) {
      all.push_back(formatted("{} bytes do not belong to a packet and are left out", lost_));
    }
    return all;
  }

 private:
  void take(const KnownMessage& known, const Packet& packet, double time_s, SeriesSink& sink) {
    // Bytes missing at the end are zeros. MAVLink 2 omits them, and MAVLink 1 does not have the
    // extension fields to which they belong.
    std::array<char, longest_packet> payload{};
    std::copy(packet.payload.begin(), packet.payload.end(), payload.begin());
    RecordBytes in({payload.data(), payload.size()});
    values_.clear();
    for (const char letter : std::string_view(known.letters)) {
      values_.push_back(letter == 'Q'   ? static_cast<double>(in.take<std::uint64_t>())
                        : letter == 'I' ? in.take<std::uint32_t>()
                        : letter == 'h' ? in.take<std::int16_t>()
                        : letter == 'H' ? in.take<std::uint16_t>()
                        : letter == 'f' ? static_cast<double>(in.take<float>())
                                        : in.take<std::uint8_t>());
    }
    flights_[static_cast<std::size_t>(&known - known_messages.data())].put(sink, values_, count_,
                                                                           time_s);
  }

  RecordStream stream_;
  std::vector<FlightMessage> flights_;
  std::vector<double> values_;
  std::size_t count_ = 0, others_ = 0, damaged_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace

bool is_tlog(std::string_view start) {
  if (start.size() <= time_size) {
    return false;
  }
  constexpr double year_2000_us = 946684800e6;
  constexpr double year_2100_us = 4102444800e6;
  const double us = big_endian_us(start);
  const auto first = static_cast<std::uint8_t>(start[time_size]);
  return us > year_2000_us && us < year_2100_us && (first == start_of_1 || first == start_of_2) &&
         packet_of(start.substr(time_size)).has_value();
}

DecoderPointer open_tlog(ByteSource bytes) {
  return std::make_unique<Tlog>(std::move(bytes));
}

}  // namespace axiscal
