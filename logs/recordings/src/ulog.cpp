// SPDX-License-Identifier: Apache-2.0
// PX4's ULog (docs.px4.io, ULog File Format, versions 1 and 2). The file contains definitions of
// messages, followed by messages; numbers are little-endian. The message "flag bits" states the
// offsets of parts that were appended to the file later.
#include <array>
#include <charconv>
#include <limits>
#include <optional>
#include <unordered_map>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/record_bytes.hpp"
#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {
namespace {

constexpr std::size_t longest_array = 16;  // longer arrays are skipped
constexpr std::size_t most_columns = 4096;
constexpr int deepest = 8;  // largest depth of messages within messages

enum class Type { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64, boolean, character, nested };

struct Primitive {
  std::string_view name;
  Type type;
  std::size_t size;
};

constexpr std::array<Primitive, 12> primitives = {{{"int8_t", Type::i8, 1},
                                                   {"uint8_t", Type::u8, 1},
                                                   {"int16_t", Type::i16, 2},
                                                   {"uint16_t", Type::u16, 2},
                                                   {"int32_t", Type::i32, 4},
                                                   {"uint32_t", Type::u32, 4},
                                                   {"int64_t", Type::i64, 8},
                                                   {"uint64_t", Type::u64, 8},
                                                   {"float", Type::f32, 4},
                                                   {"double", Type::f64, 8},
                                                   {"bool", Type::boolean, 1},
                                                   {"char", Type::character, 1}}};

// A number in a message.
struct Field {
  std::string name;
  Type type = Type::f32;
  std::size_t offset = 0;
};

template <typename Number>
double number_at(const char* at) {
  Number value{};
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double value_of(Type type, const char* at) {
  switch (type) {
    case Type::i8:
      return number_at<std::int8_t>(at);
    case Type::i16:
      return number_at<std::int16_t>(at);
    case Type::u16:
      return number_at<std::uint16_t>(at);
    case Type::i32:
      return number_at<std::int32_t>(at);
    case Type::u32:
      return number_at<std::uint32_t>(at);
    case Type::i64:
      return number_at<std::int64_t>(at);
    case Type::u64:
      return number_at<std::uint64_t>(at);
    case Type::f32:
      return number_at<float>(at);
    case Type::f64:
      return number_at<double>(at);
    default:
      return number_at<std::uint8_t>(at);
  }
}

std::size_t size_of(Type type) {
  for (const Primitive& primitive : primitives) {
    if (primitive.type == type) {
      return primitive.size;
    }
  }
  return 0;
}

// @return kind and unit of a field, according to PX4's message definitions (msg/SensorCombined.msg,
//         SensorAccel.msg, ...).
Series rule_of(const std::string& message, const std::string& column) {
  const auto is = [&](SeriesKind kind, const char* unit) {
    return Series{.kind = kind, .unit = unit, .known_by = KnownBy::format};
  };
  const bool is_axis = column == "x" || column == "y" || column == "z";
  if (column.starts_with("accelerometer_m_s2[") ||
      (is_axis && message.starts_with("sensor_accel"))) {
    return is(SeriesKind::accelerometer, "m/s^2");
  }
  if (column.starts_with("gyro_rad[") || (is_axis && message.starts_with("sensor_gyro"))) {
    return is(SeriesKind::gyroscope, "rad/s");
  }
  if (column.starts_with("magnetometer_ga[") || (is_axis && message.starts_with("sensor_mag"))) {
    return is(SeriesKind::magnetometer, "gauss");
  }
  if (column == "temperature" && message.starts_with("sensor_")) {
    return is(SeriesKind::temperature, "degC");
  }
  return {};
}

// One instance of a message type: all logged messages with this name and instance number.
struct Subscription {
  std::string name;
  int instance = 0;
  std::vector<Field> fields;  // all numbers except the time
  std::optional<Field> time;
  std::size_t least = 0;  // size of the shortest message that contains all fields [bytes]
  MessageSeries series;
  std::optional<std::size_t> device, invalid_acceleration;  // indices of these fields in `fields`
  bool is_fifo = false;
  bool has_device = false;
};

class Ulog final : public RecordingFile::Decoder {
 public:
  explicit Ulog(ByteSource bytes) : stream_(std::move(bytes)) {
    format = "ulog";
    constexpr std::size_t header = 16;
    if (stream_.take(header).size() < header) {
      throw DataError(stream_.path(), "the ULog file ends within its header");
    }
  }

  bool read(SeriesSink& sink) override {
    constexpr std::size_t head = 3;
    const std::string_view start = stream_.peek(head);
    if (start.size() < head) {
      lost_ += start.size();
      return false;
    }
    RecordBytes bytes(start);
    const std::size_t size = bytes.take<std::uint16_t>();
    const char type = bytes.take<char>();
    const std::uint64_t end = stream_.position() + head + size;
    const std::uint64_t next_part = next_offset();
    // If an appended part begins within this message, the message is incomplete.
    if (next_part > stream_.position() && next_part < end) {
      ++cut_;
      stream_.skip(next_part - stream_.position());
      return true;
    }
    if (std::string_view("BFIMPQARDLCSO").find(type) == std::string_view::npos) {
      return find_next_message();
    }
    const std::string_view record = stream_.take(head + size);
    if (record.size() < head + size) {
      lost_ += record.size();
      return false;
    }
    take_message(type, record.substr(head), sink);
    return true;
  }

  std::vector<std::string> notes() const override {
    std::vector<std::string> all;
    if (dropouts_ > 0) {
      all.push_back(formatted("the logger reports {} dropouts with a total of {} ms", dropouts_,
                              dropout_ms_));
    }
    if (cut_ > 0) {
      all.push_back(formatted(
          "{} messages are incomplete, because data were appended to the file later", cut_));
    }
    if (lost_ > 0) {
      all.push_back(formatted("{} bytes are damaged or incomplete and were left out", lost_));
    }
    if (short_ > 0) {
      all.push_back(
          formatted("{} messages are shorter than their definition and were left out", short_));
    }
    return all;
  }

 private:
  std::uint64_t next_offset() const {
    std::uint64_t next = 0;
    for (const std::uint64_t offset : appended_) {
      if (offset > stream_.position() && (next == 0 || offset < next)) {
        next = offset;
      }
    }
    return next;
  }

  // Skips bytes that are not a message, up to the next synchronisation message.
  bool find_next_message() {
    using namespace std::string_view_literals;
    lost_ += stream_.skip_to("\x08\x00S\x2F\x73\x13\x20\x25\x0C\xBB\x12"sv);
    return true;
  }

  void take_message(char type, std::string_view record, SeriesSink& sink) {
    RecordBytes bytes(record);
    switch (type) {
      case 'B': {
        bytes.skip(8);
        const bool is_appended = (bytes.take<std::uint8_t>() & 1U) != 0;
        bytes.skip(7);
        for (std::uint64_t& offset : appended_) {
          offset = is_appended ? bytes.take<std::uint64_t>() : 0;
        }
        break;
      }
      case 'F': {
        const std::size_t colon = record.find(':');
        if (colon != std::string_view::npos) {
          definitions_[std::string(record.substr(0, colon))] = record.substr(colon + 1);
        }
        break;
      }
      case 'I':
      case 'P':
        take_fact(bytes);
        break;
      case 'A': {
        const int instance = bytes.take<std::uint8_t>();
        const std::uint16_t id = bytes.take<std::uint16_t>();
        if (bytes.ok()) {
          subscriptions_[id] = subscribe(std::string(bytes.rest()), instance);
        }
        break;
      }
      case 'D': {
        const std::uint16_t id = bytes.take<std::uint16_t>();
        const auto found = subscriptions_.find(id);
        if (bytes.ok() && found != subscriptions_.end() && !found->second.fields.empty()) {
          take_data(found->second, bytes.rest(), sink);
        }
        break;
      }
      case 'O':
        ++dropouts_;
        dropout_ms_ += bytes.take<std::uint16_t>();
        break;
      default:
        break;
    }
  }

  // Reads a key such as "int32_t CAL_ACC0_ID" or "char[18] ver_hw", and its value.
  void take_fact(RecordBytes bytes) {
    const std::string_view key = bytes.text(bytes.take<std::uint8_t>());
    const std::size_t blank = key.find(' ');
    if (!bytes.ok() || blank == std::string_view::npos || facts.size() > most_columns) {
      return;
    }
    const std::string name(key.substr(blank + 1));
    const std::string_view type = key.substr(0, blank);
    if (type.starts_with("char")) {
      facts[name] = bytes.rest();
    } else if (type == "int32_t") {
      facts[name] = formatted("{}", bytes.take<std::int32_t>());
    } else if (type == "uint32_t") {
      facts[name] = formatted("{}", bytes.take<std::uint32_t>());
    } else if (type == "float") {
      facts[name] = number_text(static_cast<double>(bytes.take<float>()), 9);
    }
  }

  static constexpr double field_steps = 100.0;  // cost of a field, in units of ReadCost::steps

  // Determines the offsets of the numbers in a message, including those of nested messages.
  // @return false if a definition is missing or too large.
  // @throws LimitError  if nested messages make the cost of reading exceed a limit.
  // NOLINTNEXTLINE(misc-no-recursion): messages contain messages
  bool lay_out(const std::string& name,
               const std::string& prefix,
               int depth,
               std::size_t& offset,
               Subscription& to) const {
    const auto found = definitions_.find(name);
    if (found == definitions_.end() || depth > deepest) {
      return false;
    }
    for (const std::string_view text : split(found->second, ';')) {
      stream_.budget().spend(ReadCost::steps, field_steps);
      const std::size_t blank = text.find(' ');
      if (blank == std::string_view::npos) {
        continue;
      }
      std::string_view type = text.substr(0, blank);
      const std::string field = prefix + std::string(text.substr(blank + 1));
      std::size_t count = 1;
      const bool is_array = type.ends_with(']');
      if (is_array) {
        const std::size_t open = type.find('[');
        if (open == std::string_view::npos) {
          return false;
        }
        count = static_cast<std::size_t>(
            std::max(parse_integer(type.substr(open + 1, type.size() - open - 2)).value_or(0), 0));
        type = type.substr(0, open);
      }
      const auto* const primitive =
          std::find_if(primitives.begin(), primitives.end(),
                       [&](const Primitive& known) { return known.name == type; });
      if (primitive == primitives.end() && count > most_columns) {
        return false;
      }
      if (primitive != primitives.end() &&
          (primitive->type == Type::character || text.substr(blank + 1).starts_with("_padding") ||
           (count > longest_array && !to.is_fifo))) {
        offset += count * primitive->size;
        continue;
      }
      for (std::size_t i = 0; i < count; ++i) {
        stream_.budget().spend(ReadCost::steps, field_steps);
        const std::string full = is_array ? formatted("{}[{}]", field, i) : field;
        if (primitive == primitives.end()) {
          if (!lay_out(std::string(type), full + ".", depth + 1, offset, to)) {
            return false;
          }
          continue;
        }
        if (to.fields.size() > most_columns || offset > std::numeric_limits<std::uint16_t>::max()) {
          return false;
        }
        Field one{.name = full, .type = primitive->type, .offset = offset};
        offset += primitive->size;
        if (full == "timestamp") {
          to.time = one;
        } else {
          to.fields.push_back(std::move(one));
        }
      }
    }
    return true;
  }

  Subscription subscribe(const std::string& name, int instance) const {
    Subscription to{.name = name, .instance = instance};
    to.is_fifo = name == "sensor_accel_fifo" || name == "sensor_gyro_fifo";
    std::size_t offset = 0;
    if (!lay_out(name, "", 0, offset, to)) {
      return {.name = name};
    }
    if (to.time) {
      to.least = to.time->offset + size_of(to.time->type);
    }
    std::vector<std::string> columns;
    for (std::size_t f = 0; f < to.fields.size(); ++f) {
      const Field& field = to.fields[f];
      to.least = std::max(to.least, field.offset + size_of(field.type));
      columns.push_back(field.name);
      if (field.name == "device_id") {
        to.device = f;
      } else if (field.name == "accelerometer_timestamp_relative") {
        to.invalid_acceleration = f;
      }
    }
    const auto rule = [&](const std::string& column) { return rule_of(name, column); };
    to.series = to.is_fifo ? MessageSeries(name, instance, {"x", "y", "z"}, rule)
                           : MessageSeries(name, instance, columns, rule);
    return to;
  }

  void take_data(Subscription& to, std::string_view data, SeriesSink& sink) {
    if (data.size() < to.least) {
      ++short_;
      return;
    }
    if (!to.series.announced()) {
      to.series.announce(sink, count_);
    }
    values_.clear();
    for (const Field& field : to.fields) {
      values_.push_back(value_of(field.type, data.data() + field.offset));
    }
    const double time_us =
        to.time ? value_of(to.time->type, data.data() + to.time->offset) : not_a_number;
    if (to.device && !to.has_device) {
      to.has_device = true;
      facts[formatted("device_id {} {}", to.name, to.instance)] =
          formatted("{}", static_cast<std::uint32_t>(values_[*to.device]));
    }
    constexpr double us = 1e-6;
    if (to.is_fifo) {
      take_fifo(to, time_us * us, sink);
      return;
    }
    constexpr double invalid = -2147483648.0;
    if (to.invalid_acceleration && values_[*to.invalid_acceleration] == invalid) {
      for (std::size_t f = 0; f < to.fields.size(); ++f) {
        if (to.fields[f].name.starts_with("accelerometer_m_s2[")) {
          values_[f] = not_a_number;
        }
      }
    }
    to.series.put(sink, time_us * us, values_);
  }

  // Reads a message that contains several samples. Its field `samples` is the number of samples in
  // the arrays x[32], y[32] and z[32], which are in units of `scale`. The samples are `dt` us
  // apart, and the time of the last one is `timestamp_sample`.
  void take_fifo(Subscription& to, double time_s, SeriesSink& sink) {
    const auto place = [&](const std::string& name) -> std::optional<std::size_t> {
      for (std::size_t f = 0; f < to.fields.size(); ++f) {
        if (to.fields[f].name == name) {
          return f;
        }
      }
      return std::nullopt;
    };
    const auto x = place("x[0]");
    const auto y = place("y[0]");
    const auto z = place("z[0]");
    const auto samples = place("samples");
    const auto scale = place("scale");
    const auto dt = place("dt");
    if (!x || !y || !z || !samples || !scale || !dt) {
      return;
    }
    constexpr double us = 1e-6;
    const auto last = place("timestamp_sample");
    const double end_s = last ? values_[*last] * us : time_s;
    const std::size_t room =
        std::min({*y > *x ? *y - *x : 0, *z > *y ? *z - *y : 0, values_.size() - *z});
    const auto n = std::min(static_cast<std::size_t>(std::max(values_[*samples], 0.0)), room);
    for (std::size_t i = 0; i < n; ++i) {
      const std::array<double, 3> sample = {values_[*scale] * values_[*x + i],
                                            values_[*scale] * values_[*y + i],
                                            values_[*scale] * values_[*z + i]};
      to.series.put(sink, end_s - static_cast<double>(n - 1 - i) * values_[*dt] * us, sample);
    }
  }

  RecordStream stream_;
  std::array<std::uint64_t, 3> appended_{};
  std::map<std::string, std::string, std::less<>> definitions_;
  std::unordered_map<std::uint16_t, Subscription> subscriptions_;
  std::vector<double> values_;
  std::size_t count_ = 0;
  std::size_t dropouts_ = 0, dropout_ms_ = 0, cut_ = 0, short_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace

DecoderPointer open_ulog(ByteSource bytes) {
  return std::make_unique<Ulog>(std::move(bytes));
}

}  // namespace axiscal
