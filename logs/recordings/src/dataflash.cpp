// SPDX-License-Identifier: Apache-2.0
// ArduPilot's DataFlash logs (ardupilot.org, "Adding a new log message"). Each message consists of
// the bytes A3 95, the number of its type, and its fields. Messages of type FMT (128) describe the
// fields of the other types.
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <set>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/flight_messages.hpp"
#include "logs/recordings/src/record_bytes.hpp"
#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {
namespace {

struct Letter {
  char letter;
  std::size_t size;
  double scale;  // factor that multiplies the stored number; 0 for text or an array
};

constexpr std::array<Letter, 20> letters = {
    {{'a', 64, 0},   {'b', 1, 1},    {'B', 1, 1},    {'h', 2, 1},    {'H', 2, 1},
     {'i', 4, 1},    {'I', 4, 1},    {'f', 4, 1},    {'d', 8, 1},    {'n', 4, 0},
     {'N', 16, 0},   {'Z', 64, 0},   {'c', 2, 0.01}, {'C', 2, 0.01}, {'e', 4, 0.01},
     {'E', 4, 0.01}, {'L', 4, 1e-7}, {'M', 1, 1},    {'q', 8, 1},    {'Q', 8, 1}}};

const Letter* letter_of(char letter) {
  const auto* const found = std::find_if(
      letters.begin(), letters.end(), [&](const Letter& known) { return known.letter == letter; });
  return found == letters.end() ? nullptr : found;
}

double half_float(std::uint16_t bits) {
  const int exponent = (bits >> 10U) & 0x1F;
  const int fraction = bits & 0x3FF;
  const double sign = (bits & 0x8000U) != 0 ? -1.0 : 1.0;
  if (exponent == 31) {
    return not_a_number;
  }
  return sign *
         (exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024 + fraction, exponent - 25));
}

double take_number(RecordBytes& bytes, char letter) {
  switch (letter) {
    case 'b':
      return bytes.take<std::int8_t>();
    case 'B':
    case 'M':
      return bytes.take<std::uint8_t>();
    case 'h':
      return bytes.take<std::int16_t>();
    case 'c':  // divided by 100, so that 1234 becomes the double nearest to 12.34
      return bytes.take<std::int16_t>() / 100.0;
    case 'H':
      return bytes.take<std::uint16_t>();
    case 'C':
      return bytes.take<std::uint16_t>() / 100.0;
    case 'i':
      return bytes.take<std::int32_t>();
    case 'e':
      return bytes.take<std::int32_t>() / 100.0;
    case 'L':
      return bytes.take<std::int32_t>() / 1e7;
    case 'I':
      return bytes.take<std::uint32_t>();
    case 'E':
      return bytes.take<std::uint32_t>() / 100.0;
    case 'f':
      return bytes.take<float>();
    case 'd':
      return bytes.take<double>();
    case 'q':
      return static_cast<double>(bytes.take<std::int64_t>());
    case 'Q':
      return static_cast<double>(bytes.take<std::uint64_t>());
    case 'g':
      return half_float(bytes.take<std::uint16_t>());
    default:
      return not_a_number;
  }
}

// A text field, which ends at the first zero byte.
std::string text_field(std::string_view bytes) {
  return std::string(bytes.substr(0, bytes.find('\0')));
}

struct Message {
  std::string name, format;
  std::size_t size = 0;  // size of a message in bytes, including the header A3 95 and the type
  std::vector<std::string> columns;
  FlightMessage flight;
};

class Dataflash final : public RecordingFile::Decoder {
 public:
  explicit Dataflash(ByteSource bytes) : stream_(std::move(bytes)) { format = "dataflash"; }

  bool read(SeriesSink& sink) override {
    constexpr std::size_t head = 3;
    constexpr std::uint8_t format_message = 128;
    constexpr std::size_t format_size = 89;
    const std::string_view start = stream_.peek(head);
    if (start.size() < head) {
      lost_ += start.size();
      return false;
    }
    const auto id = static_cast<std::uint8_t>(start[2]);
    const bool is_head = start.starts_with("\xA3\x95");
    const auto known = messages_.find(id);
    if (!is_head || (id != format_message && known == messages_.end())) {
      lost_ += stream_.skip_to("\xA3\x95");
      is_lost_ = true;
      return true;
    }
    const std::size_t size = id == format_message ? format_size : known->second.size;
    if (is_lost_) {  // after damage, a message is valid only if another one follows it
      const std::string_view ahead = stream_.peek(size + 2);
      if (ahead.size() == size + 2 && !ahead.substr(size).starts_with("\xA3\x95")) {
        lost_ += stream_.skip_to("\xA3\x95");
        return true;
      }
      is_lost_ = false;
    }
    if (stream_.peek(size).size() < size) {
      unfinished_ += stream_.take(size).size();
      return false;
    }
    RecordBytes bytes(stream_.take(size));
    bytes.skip(head);
    if (id == format_message) {
      take_format(bytes);
    } else {
      take_message(known->second, bytes, sink);
    }
    return true;
  }

  std::vector<std::string> notes() const override {
    std::vector<std::string> all;
    if (lost_ > 0) {
      all.push_back(formatted("{} bytes do not belong to a message and are left out", lost_));
    }
    if (unfinished_ > 0) {
      all.push_back(formatted("the last message is cut short ({} bytes)", unfinished_));
    }
    return all;
  }

 private:
  void take_format(RecordBytes& bytes) {
    const std::uint8_t id = bytes.take<std::uint8_t>();
    Message message{.size = bytes.take<std::uint8_t>()};
    message.name = text_field(bytes.text(4));
    message.format = text_field(bytes.text(16));
    const std::string columns = text_field(bytes.text(64));
    std::size_t size = 3;
    for (const char letter : message.format) {
      const Letter* const known = letter_of(letter);
      if (known == nullptr && letter != 'g') {
        ++strange_;
        return;
      }
      size += known == nullptr ? 2 : known->size;
    }
    for (const std::string_view column : split(columns, ',')) {
      message.columns.emplace_back(column);
    }
    constexpr std::uint8_t format_message = 128;
    if (size != message.size || message.columns.size() != message.format.size() ||
        id == format_message) {
      return;
    }
    message.flight = FlightMessage(message.name, numbers_of(message));
    messages_[id] = std::move(message);
  }

  static std::vector<std::string> numbers_of(const Message& message) {
    std::vector<std::string> names;
    for (std::size_t c = 0; c < message.format.size(); ++c) {
      const Letter* const known = letter_of(message.format[c]);
      if (known == nullptr || known->scale != 0.0) {
        names.push_back(message.columns[c]);
      }
    }
    return names;
  }

  void take_message(Message& message, RecordBytes bytes, SeriesSink& sink) {
    values_.clear();
    // texts[0] is the last text field. In a PARM message, this is the parameter's name.
    std::array<std::string, 2> texts;
    for (std::size_t c = 0; c < message.format.size(); ++c) {
      const Letter* const known = letter_of(message.format[c]);
      if (known != nullptr && known->scale == 0.0) {
        texts[0] = text_field(bytes.text(known->size));
      } else {
        values_.push_back(take_number(bytes, message.format[c]));
      }
    }
    if (message.name == "PARM" && values_.size() >= 2) {
      facts[texts[0]] = number_text(values_[1], 9);  // the fields are TimeUS, Name, Value
      return;
    }
    // Messages about the log itself are not readings.
    if (message.name != "UNIT" && message.name != "MULT" && message.name != "FMTU") {
      message.flight.put(sink, values_, count_);
    }
  }

  RecordStream stream_;
  std::map<std::uint8_t, Message> messages_;
  std::vector<double> values_;
  std::size_t count_ = 0, strange_ = 0, unfinished_ = 0;
  std::uint64_t lost_ = 0;
  bool is_lost_ = false;  // true if the last bytes were not a message
};

}  // namespace

DecoderPointer open_dataflash(ByteSource bytes) {
  return std::make_unique<Dataflash>(std::move(bytes));
}

}  // namespace axiscal
