// SPDX-License-Identifier: Apache-2.0
// Betaflight's blackbox (betaflight.com, "Blackbox Internals"): lines `H name:value`, then frames.
// I frames contain complete values, and P frames contain differences to the frames before them. S,
// G and H frames contain slowly changing values and GPS data, and E frames contain events. A frame
// is valid if another frame begins where it ends, and neither its iteration number nor its time
// jumps. After an invalid frame, P frames are skipped up to the next I frame.
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/record_bytes.hpp"
#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {
namespace {

constexpr std::string_view first_line = "H Product:Blackbox";
constexpr std::size_t longest_frame = 256;
constexpr std::size_t most_fields = 256;
constexpr std::int64_t longest_leap = 5000;  // largest accepted jump of the iteration number
constexpr std::int64_t longest_pause_us = 10000000;

enum Predictor : int {
  previous = 1,
  straight_line = 2,
  average = 3,
  minimum_throttle = 4,
  first_motor = 5,
  increment = 6,
  centre_1500 = 8,
  battery = 9,
  last_time = 10,
  minimum_motor = 11
};

enum Encoding : int {
  signed_variable = 0,
  unsigned_variable = 1,
  negative_14_bits = 3,
  eight_flagged = 6,
  three_of_32 = 7,
  four_of_16 = 8,
  nothing_sent = 9,
  three_variable = 10
};

using Frame = std::vector<std::int32_t>;

std::int32_t sign_extended(std::uint32_t value, unsigned bits) {
  const unsigned shift = 32U - bits;
  return static_cast<std::int32_t>(value << shift) >> shift;
}

// Reads the numbers of a frame.
class FrameBytes {
 public:
  explicit FrameBytes(std::string_view bytes) : bytes_(bytes) {}

  std::uint32_t byte() { return bytes_.take<std::uint8_t>(); }

  std::uint32_t unsigned_number() {
    std::uint32_t value = 0;
    constexpr unsigned most_bytes = 5;
    for (unsigned i = 0; i < most_bytes; ++i) {
      const std::uint32_t next = byte();
      value |= (next & 0x7FU) << (7U * i);
      if ((next & 0x80U) == 0) {
        return value;
      }
    }
    return 0;
  }

  std::int32_t signed_number() {
    const std::uint32_t value = unsigned_number();
    return static_cast<std::int32_t>((value >> 1U) ^ (0U - (value & 1U)));
  }

  void eight(std::int32_t* values, std::size_t count) {
    if (count == 1) {
      values[0] = signed_number();
      return;
    }
    std::uint32_t flags = byte();
    for (std::size_t i = 0; i < count; ++i, flags >>= 1U) {
      values[i] = (flags & 1U) != 0 ? signed_number() : 0;
    }
  }

  void three(std::int32_t* values, bool is_variable) {
    std::uint32_t lead = byte();
    switch (lead >> 6U) {
      case 0:
        values[0] = sign_extended(lead >> 4U, 2);
        values[1] = sign_extended(lead >> 2U, 2);
        values[2] = sign_extended(lead, 2);
        break;
      case 1: {
        const std::uint32_t second = byte();
        if (is_variable) {  // values of 5, 5 and 4 bits
          values[0] = sign_extended(lead >> 1U, 5);
          values[1] = sign_extended((lead & 1U) << 4U | second >> 4U, 5);
        } else {
          values[0] = sign_extended(lead, 4);
          values[1] = sign_extended(second >> 4U, 4);
        }
        values[2] = sign_extended(second, 4);
        break;
      }
      case 2: {
        const std::uint32_t second = byte();
        const std::uint32_t third = byte();
        if (is_variable) {  // values of 8, 7 and 7 bits
          values[0] = sign_extended((lead & 0x3FU) << 2U | second >> 6U, 8);
          values[1] = sign_extended((second & 0x3FU) << 1U | third >> 7U, 7);
          values[2] = sign_extended(third, 7);
        } else {
          values[0] = sign_extended(lead, 6);
          values[1] = sign_extended(second, 6);
          values[2] = sign_extended(third, 6);
        }
        break;
      }
      default:
        for (std::size_t i = 0; i < 3; ++i, lead >>= 2U) {
          const unsigned bytes = (lead & 3U) + 1;
          std::uint32_t value = 0;
          for (unsigned b = 0; b < bytes; ++b) {
            value |= byte() << (8U * b);
          }
          values[i] = sign_extended(value, 8U * bytes);
        }
    }
  }

  void four(std::int32_t* values, int version) {
    std::uint32_t selector = byte();
    if (version < 2) {
      for (std::size_t i = 0; i < 4; ++i, selector >>= 2U) {
        switch (selector & 3U) {
          case 0:
            values[i] = 0;
            break;
          case 1: {  // two values of four bits
            const std::uint32_t both = byte();
            values[i] = sign_extended(both, 4);
            if (i + 1 < 4) {
              values[++i] = sign_extended(both >> 4U, 4);
              selector >>= 2U;
            }
            break;
          }
          case 2:
            values[i] = sign_extended(byte(), 8);
            break;
          default: {
            const std::uint32_t low = byte();
            values[i] = sign_extended(low | byte() << 8U, 16);
          }
        }
      }
      return;
    }
    bool half = false;  // true if four bits of `buffer` have not been used yet
    std::uint32_t buffer = 0;
    const auto bits = [&](unsigned nibbles) {
      std::uint32_t value = 0;
      for (unsigned n = 0; n < nibbles; ++n) {
        if (half) {
          value = value << 4U | (buffer & 0xFU);
        } else {
          buffer = byte();
          value = value << 4U | buffer >> 4U;
        }
        half = !half;
      }
      return value;
    };
    for (std::size_t i = 0; i < 4; ++i, selector >>= 2U) {
      const unsigned nibbles = (selector & 3U) == 0 ? 0 : 1U << ((selector & 3U) - 1U);
      values[i] = nibbles == 0 ? 0 : sign_extended(bits(nibbles), 4 * nibbles);
    }
  }

  [[nodiscard]] bool ok() const { return bytes_.ok(); }
  [[nodiscard]] std::size_t at() const { return bytes_.at(); }
  void skip(std::size_t size) { bytes_.skip(size); }

 private:
  RecordBytes bytes_;
};

struct FrameFields {
  std::vector<std::string> names;
  std::vector<int> predictors, encodings, is_signed;

  [[nodiscard]] bool complete() const {
    return !names.empty() && predictors.size() == names.size() && encodings.size() == names.size();
  }
};

// The header of one log.
struct LogHeader {
  int version = 1;
  std::int64_t interval = 32;  // number of iterations from one I frame to the next
  std::int64_t p_number = 1, p_of = 1;
  std::int32_t minimum_throttle = 1150, minimum_motor = 1150, battery = 4095;
  double counts_per_g = 0.0;
  double gyro_scale = 1.0;  // deg/s per count
  std::map<char, FrameFields> frames;
};

std::vector<int> integers_of(std::string_view text) {
  std::vector<int> all;
  for (const std::string_view part : split(text, ',')) {
    all.push_back(parse_integer(part).value_or(0));
  }
  return all;
}

void take_header_line(std::string_view line, LogHeader& header) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) {
    return;
  }
  const std::string_view key = trimmed(line.substr(0, colon));
  const std::string_view value = trimmed(line.substr(colon + 1));
  const auto whole = [&](int otherwise) { return parse_integer(value).value_or(otherwise); };
  if (key.starts_with("Field ") && key.size() > 8) {
    FrameFields& fields = header.frames[key[6]];
    const std::string_view what = key.substr(8);
    if (what == "name") {
      fields.names.clear();
      for (const std::string_view name : split(value, ',')) {
        fields.names.emplace_back(name);
      }
      if (fields.names.size() > most_fields) {
        fields.names.clear();
      }
    } else if (what == "predictor") {
      fields.predictors = integers_of(value);
    } else if (what == "encoding") {
      fields.encodings = integers_of(value);
    } else if (what == "signed") {
      fields.is_signed = integers_of(value);
    }
  } else if (key == "Data version") {
    header.version = whole(1);
  } else if (key == "I interval") {
    header.interval = std::max(whole(1), 1);
  } else if (key == "P interval") {
    const std::size_t slash = value.find('/');
    const bool is_ratio = slash != std::string_view::npos;
    header.p_number = is_ratio ? std::max(parse_integer(value.substr(0, slash)).value_or(1), 1) : 1;
    header.p_of =
        std::max(is_ratio ? parse_integer(value.substr(slash + 1)).value_or(1) : whole(1), 1);
  } else if (key == "minthrottle") {
    header.minimum_throttle = whole(0);
    header.minimum_motor = whole(0);
  } else if (key == "motorOutput") {
    header.minimum_motor = integers_of(value).front();
  } else if (key == "vbatref") {
    header.battery = whole(0);
  } else if (key == "acc_1G") {
    header.counts_per_g = whole(0);
  } else if (key == "gyro_scale" || key == "gyro.scale") {
    if (value.starts_with("0x")) {
      std::uint32_t bits = 0;
      for (const char c : value.substr(2)) {
        const int digit = c >= '0' && c <= '9'   ? c - '0'
                          : c >= 'a' && c <= 'f' ? c - 'a' + 10
                          : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                                 : 0;
        bits = bits << 4U | static_cast<std::uint32_t>(digit);
      }
      const double scale = static_cast<double>(std::bit_cast<float>(bits));
      header.gyro_scale = scale > 0.0 && std::isfinite(scale) ? scale : 1.0;
    }
  }
}

class Blackbox final : public RecordingFile::Decoder {
 public:
  explicit Blackbox(ByteSource bytes) : stream_(std::move(bytes)) { format = "blackbox"; }

  bool read(SeriesSink& sink) override {
    const std::string_view ahead = stream_.peek(ahead_size);
    if (ahead.empty()) {
      return false;
    }
    if (ahead.starts_with(first_line)) {
      begin_log();
      return true;
    }
    if (in_header_) {
      if (ahead.starts_with("H ")) {
        header_line();
        return true;
      }
      end_header();
    }
    const std::size_t size = frame(ahead, sink);
    if (size == 0) {
      lost_ += stream_.skip(1);
      stream_is_valid_ = false;
    } else {
      stream_.skip(size);
    }
    return true;
  }

  std::vector<std::string> notes() const override {
    std::vector<std::string> all;
    if (left_out_ > 0) {
      all.push_back(formatted(
          "{} frames are left out, because they follow a damaged frame or a change of flight mode, "
          "or because their times jump",
          left_out_));
    }
    if (lost_ > 0) {
      all.push_back(formatted("{} bytes do not belong to a frame and are left out", lost_));
    }
    return all;
  }

 private:
  static constexpr std::size_t ahead_size = 2 * longest_frame + 64;

  void begin_log() {
    header_ = {};
    in_header_ = true;
    ++instance_;
    last_iteration_.reset();
    stream_is_valid_ = false;
    series_ = {};
    header_line();
  }

  void header_line() {
    constexpr std::size_t longest = 1U << 16U;
    const std::string_view text = stream_.peek(longest);
    const std::size_t end = text.find('\n');
    const std::string line(text.substr(0, end));
    stream_.skip(end == std::string_view::npos ? text.size() : end + 1);
    take_header_line(std::string_view(line).substr(std::min<std::size_t>(2, line.size())), header_);
    const std::size_t colon = line.find(':');
    if (colon != std::string::npos && colon > 2 && facts.size() < 1000) {
      facts[line.substr(2, colon - 2)] = trimmed(std::string_view(line).substr(colon + 1));
    }
  }

  void end_header() {
    in_header_ = false;
    if (header_.frames.contains('I')) {
      header_.frames['P'].names = header_.frames['I'].names;
    }
    main_ = &header_.frames['I'];
    has_main_ = main_->complete() && header_.frames['P'].complete() && main_->names.size() >= 2;
    motor_ = main_->names.size();
    scales_.assign(main_->names.size(), 1.0);
    std::vector<std::string> columns;
    places_.clear();
    time_ = 1;
    for (std::size_t f = 0; f < main_->names.size(); ++f) {
      const std::string& name = main_->names[f];
      if (name == "motor[0]") {
        motor_ = f;
      } else if (name.starts_with("accSmooth[") && header_.counts_per_g > 0.0) {
        scales_[f] = header_.counts_per_g;
      } else if (name.starts_with("gyroADC[")) {
        scales_[f] = 1.0 / header_.gyro_scale;
      }
      if (name == "time") {
        time_ = f;
      } else {
        columns.push_back(name);
        places_.push_back(f);
      }
    }
    const bool has_g = header_.counts_per_g > 0.0;
    series_ = MessageSeries("main", std::max(instance_, 0), columns, [&](const std::string& name) {
      const auto is = [&](SeriesKind kind, const char* unit) {
        return Series{.kind = kind, .unit = unit, .known_by = KnownBy::format};
      };
      return name.starts_with("gyroADC[")     ? is(SeriesKind::gyroscope, "deg/s")
             : name.starts_with("accSmooth[") ? is(SeriesKind::accelerometer, has_g ? "g" : "")
             : name.starts_with("magADC[")    ? is(SeriesKind::magnetometer, "")
                                              : Series{};
    });
  }

  // @return the size of the frame at the start of the bytes; 0 if no valid frame starts there.
  std::size_t frame(std::string_view ahead, SeriesSink& sink) {
    const char type = ahead.front();
    FrameBytes bytes(ahead.substr(1));
    if (type == 'E') {
      return event(bytes, ahead);
    }
    const bool is_main = type == 'I' || type == 'P';
    const auto fields = header_.frames.find(type);
    if (fields == header_.frames.end() || !fields->second.complete() || (is_main && !has_main_)) {
      return 0;
    }
    if (type == 'P' && !stream_is_valid_) {
      // The frame is decoded only to find its end. The sizes of its fields do not depend on the
      // frames before it.
      scratch_.assign(fields->second.names.size(), 0);
      read_fields(bytes, fields->second, scratch_, nullptr, nullptr, 0);
      const std::size_t size = 1 + bytes.at();
      if (!bytes.ok() || size > longest_frame || !begins_frame(ahead, size)) {
        return 0;
      }
      ++left_out_;
      return size;
    }
    const Frame* const before = type == 'P' ? &previous_ : nullptr;
    const Frame* const earlier = type == 'P' ? &earlier_ : nullptr;
    scratch_.assign(fields->second.names.size(), 0);
    read_fields(bytes, fields->second, scratch_, before, earlier,
                type == 'P' ? skipped_iterations() : 0);
    const std::size_t size = 1 + bytes.at();
    if (!bytes.ok() || size > longest_frame || !begins_frame(ahead, size)) {
      return 0;
    }
    if (is_main) {
      take_main(type, sink);
    }
    return size;
  }

  [[nodiscard]] bool begins_frame(std::string_view ahead, std::size_t at) const {
    return at >= ahead.size()
               ? ahead.size() < ahead_size
               : std::string_view("IPSGHE").find(ahead[at]) != std::string_view::npos;
  }

  // @return the number of iterations that the logger skips after the last frame because of its
  //         settings.
  [[nodiscard]] std::int64_t skipped_iterations() const {
    if (!last_iteration_) {
      return 0;
    }
    std::int64_t skipped = 0;
    for (std::int64_t i = *last_iteration_ + 1;
         (i % header_.interval + header_.p_number - 1) % header_.p_of >= header_.p_number &&
         skipped < longest_leap;
         ++i) {
      ++skipped;
    }
    return skipped;
  }

  [[nodiscard]] std::int32_t predicted(const FrameFields& fields,
                                       std::size_t f,
                                       std::int32_t value,
                                       const Frame& frame,
                                       const Frame* before,
                                       const Frame* earlier) const {
    const auto sum = [&](std::int64_t other) {
      return static_cast<std::int32_t>(static_cast<std::uint32_t>(value + other));
    };
    switch (fields.predictors[f]) {
      case previous:
        return before != nullptr ? sum((*before)[f]) : value;
      case straight_line:
        return before != nullptr ? sum(2 * static_cast<std::int64_t>((*before)[f]) - (*earlier)[f])
                                 : value;
      case average:
        return before != nullptr
                   ? sum((static_cast<std::int64_t>((*before)[f]) + (*earlier)[f]) / 2)
                   : value;
      case minimum_throttle:
        return sum(header_.minimum_throttle);
      case minimum_motor:
        return sum(header_.minimum_motor);
      case first_motor:
        return motor_ < frame.size() ? sum(frame[motor_]) : value;
      case centre_1500:
        return sum(1500);
      case battery:
        return sum(header_.battery);
      case last_time:
        return time_ < previous_.size() ? sum(previous_[time_]) : value;
      default:
        return value;
    }
  }

  void read_fields(FrameBytes& bytes,
                   const FrameFields& fields,
                   Frame& frame,
                   const Frame* before,
                   const Frame* earlier,
                   std::int64_t skipped) const {
    const std::size_t n = fields.names.size();
    std::array<std::int32_t, 8> values{};
    for (std::size_t f = 0; f < n;) {
      if (fields.predictors[f] == increment) {
        frame[f] = static_cast<std::int32_t>(skipped + 1 + (before != nullptr ? (*before)[f] : 0));
        ++f;
        continue;
      }
      std::size_t count = 1;
      values.fill(0);
      switch (fields.encodings[f]) {
        case signed_variable:
          values[0] = bytes.signed_number();
          break;
        case unsigned_variable:
          values[0] = static_cast<std::int32_t>(bytes.unsigned_number());
          break;
        case negative_14_bits:
          values[0] = -sign_extended(bytes.unsigned_number(), 14);
          break;
        case eight_flagged:
          while (count < 8 && f + count < n && fields.encodings[f + count] == eight_flagged) {
            ++count;
          }
          bytes.eight(values.data(), count);
          break;
        case three_of_32:
        case three_variable:
          count = 3;
          bytes.three(values.data(), fields.encodings[f] == three_variable);
          break;
        case four_of_16:
          count = 4;
          bytes.four(values.data(), header_.version);
          break;
        case nothing_sent:
          break;
        default:
          bytes.skip(ahead_size);  // unknown encoding: the size of the field is not known
      }
      for (std::size_t i = 0; i < count && f < n; ++i, ++f) {
        frame[f] = predicted(fields, f, values[i], frame, before, earlier);
      }
    }
  }

  void take_main(char type, SeriesSink& sink) {
    const std::int64_t iteration = static_cast<std::uint32_t>(scratch_[0]);
    // The clock has 32 bits and overflows after 71 minutes.
    std::int64_t time = static_cast<std::uint32_t>(scratch_[time_]) + rollovers_;
    constexpr std::int64_t turn = std::int64_t{1} << 32U;
    if (last_iteration_ && time + turn / 2 < last_time_) {
      time += turn;
    }
    const bool fits =
        !last_iteration_ ||
        (iteration >= *last_iteration_ && iteration < *last_iteration_ + longest_leap &&
         time >= last_time_ && time < last_time_ + longest_pause_us);
    if (!fits) {
      stream_is_valid_ = false;
      ++left_out_;
      return;
    }
    stream_is_valid_ = true;
    rollovers_ = time - static_cast<std::uint32_t>(scratch_[time_]);
    last_iteration_ = iteration;
    last_time_ = time;
    earlier_ = type == 'I' ? scratch_ : previous_;
    previous_ = scratch_;
    values_.clear();
    for (const std::size_t place : places_) {
      const bool is_unsigned = place < main_->is_signed.size() && main_->is_signed[place] == 0;
      values_.push_back((is_unsigned
                             ? static_cast<double>(static_cast<std::uint32_t>(scratch_[place]))
                             : static_cast<double>(scratch_[place])) /
                        scales_[place]);
    }
    if (!series_.announced()) {
      series_.announce(sink, count_);
    }
    series_.put(sink, static_cast<double>(time) * 1e-6, values_);
  }

  std::size_t event(FrameBytes& bytes, std::string_view ahead) {
    enum : std::uint32_t {
      beep = 0,
      adjustment = 13,
      resume = 14,
      disarm = 15,
      mode = 30,
      end = 255
    };
    const std::uint32_t type = bytes.byte();
    switch (type) {
      case beep:
        bytes.unsigned_number();
        break;
      case disarm:
        bytes.unsigned_number();
        stream_is_valid_ = false;  // for the reason stated at `mode`
        break;
      case adjustment: {
        const std::uint32_t function = bytes.byte();
        if (function >= 128) {
          bytes.skip(4);
        } else {
          bytes.signed_number();
        }
        break;
      }
      case resume:
        last_iteration_ = bytes.unsigned_number();
        last_time_ = bytes.unsigned_number() + rollovers_;
        break;
      case mode:
        // Users check logs with blackbox_decode, which does not know this event and leaves out the
        // frames from here to the next I frame. This reader does the same.
        bytes.unsigned_number();
        bytes.unsigned_number();
        stream_is_valid_ = false;
        break;
      case end: {
        using namespace std::string_view_literals;
        if (!ahead.substr(2).starts_with("End of log\0"sv)) {
          return 0;
        }
        bytes.skip(11);
        stream_is_valid_ = false;
        break;
      }
      default:
        return 0;
    }
    return bytes.ok() ? 1 + bytes.at() : 0;
  }

  RecordStream stream_;
  LogHeader header_;
  bool in_header_ = false;
  const FrameFields* main_ = nullptr;
  bool has_main_ = false;
  int instance_ = -1;
  std::size_t time_ = 1, motor_ = 0;
  std::vector<double> scales_;
  std::vector<std::size_t> places_;
  MessageSeries series_;
  Frame scratch_, previous_, earlier_;
  std::vector<double> values_;
  bool stream_is_valid_ = false;
  std::optional<std::int64_t> last_iteration_;
  std::int64_t last_time_ = 0, rollovers_ = 0;
  std::size_t count_ = 0, left_out_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace

bool is_blackbox(std::string_view start) {
  return start.find(first_line) != std::string_view::npos;
}

DecoderPointer open_blackbox(ByteSource bytes) {
  return std::make_unique<Blackbox>(std::move(bytes));
}

}  // namespace axiscal
