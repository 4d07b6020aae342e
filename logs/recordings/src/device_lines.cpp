// SPDX-License-Identifier: Apache-2.0
// Decoders for lines that devices print: VectorNav's $VN.. sentences (VN-100 user manual,
// asynchronous messages), and the lines `Raw:` and `Uni:` for PJRC's MotionCal.
#include <algorithm>
#include <array>
#include <cctype>
#include <optional>

#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/line_stream.hpp"
#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {
namespace {

Series of_kind(SeriesKind kind, const char* unit) {
  return {.kind = kind, .unit = unit, .known_by = KnownBy::format};
}

// @return a note about the lines that were left out; empty if `lines` is 0.
std::vector<std::string> left_out(std::size_t lines, const char* why) {
  return lines > 0 ? std::vector{formatted("{} lines {}, and are left out", lines, why)}
                   : std::vector<std::string>{};
}

// The name and the columns of a message such as $VNYMR,yaw,pitch,roll,mag,acc,gyro*68.
struct VectorNavMessage {
  std::string_view name;
  std::string_view columns;
};

constexpr std::array<VectorNavMessage, 7> vectornav_messages = {
    {{"VNYMR", "yaw,pitch,roll,magX,magY,magZ,accX,accY,accZ,gyroX,gyroY,gyroZ"},
     {"VNQMR", "qx,qy,qz,qw,magX,magY,magZ,accX,accY,accZ,gyroX,gyroY,gyroZ"},
     {"VNIMU", "magX,magY,magZ,accX,accY,accZ,gyroX,gyroY,gyroZ,temperature,pressure"},
     {"VNMAR", "magX,magY,magZ,accX,accY,accZ,gyroX,gyroY,gyroZ"},
     {"VNACC", "accX,accY,accZ"},
     {"VNMAG", "magX,magY,magZ"},
     {"VNGYR", "gyroX,gyroY,gyroZ"}}};

Series vectornav_rule(const std::string& column) {
  return column.starts_with("mag")    ? of_kind(SeriesKind::magnetometer, "gauss")
         : column.starts_with("acc")  ? of_kind(SeriesKind::accelerometer, "m/s^2")
         : column.starts_with("gyro") ? of_kind(SeriesKind::gyroscope, "rad/s")
         : column == "temperature"    ? of_kind(SeriesKind::temperature, "degC")
         : column == "yaw" || column == "pitch" || column == "roll"
             ? of_kind(SeriesKind::other, "deg")
             : Series{};
}

// @return the text between $ and *; nullopt if the line is not a VectorNav sentence or its checksum
//         is wrong. The checksum is the exclusive or of the characters of this text.
std::optional<std::string_view> sentence_of(std::string_view line) {
  constexpr std::size_t digits = 2;
  line = trimmed(line);
  const std::size_t star = line.rfind('*');
  if (!line.starts_with("$VN") || star == std::string_view::npos ||
      line.size() != star + 1 + digits) {
    return std::nullopt;
  }
  const std::string_view sentence = line.substr(1, star - 1);
  unsigned sum = 0;
  for (const char c : sentence) {
    sum ^= static_cast<unsigned char>(c);
  }
  const std::string wanted = formatted("{:02X}", sum);
  const bool is_right =
      std::equal(wanted.begin(), wanted.end(), line.begin() + static_cast<std::ptrdiff_t>(star) + 1,
                 [](char a, char b) { return a == std::toupper(static_cast<unsigned char>(b)); });
  return is_right ? std::optional(sentence) : std::nullopt;
}

class VectorNav final : public RecordingFile::Decoder {
 public:
  explicit VectorNav(ByteSource bytes) : lines_(std::move(bytes)) { format = "vectornav"; }

  bool read(SeriesSink& sink) override {
    std::string_view line;
    if (!lines_.next(line)) {
      return false;
    }
    const std::optional<std::string_view> sentence = sentence_of(line);
    if (!sentence) {
      damaged_ += trimmed(line).empty() ? 0U : 1U;
      return true;
    }
    const std::vector<std::string_view> cells = split(*sentence, ',');
    const std::string name(cells.front());
    const auto* const known =
        std::find_if(vectornav_messages.begin(), vectornav_messages.end(),
                     [&](const VectorNavMessage& message) { return message.name == name; });
    if (known == vectornav_messages.end()) {
      return true;
    }
    const std::vector<std::string_view> columns = split(known->columns, ',');
    if (cells.size() != columns.size() + 1) {
      ++damaged_;
      return true;
    }
    MessageSeries& series = series_[name];
    if (!series.announced()) {
      series = MessageSeries(name, 0, {columns.begin(), columns.end()}, vectornav_rule);
      series.announce(sink, count_);
    }
    values_.clear();
    for (std::size_t c = 1; c < cells.size(); ++c) {
      values_.push_back(parse_number(cells[c]).value_or(not_a_number));
    }
    series.put(sink, not_a_number, values_);
    return true;
  }

  std::vector<std::string> notes() const override {
    return left_out(damaged_, "are broken or have a wrong checksum");
  }

 private:
  LineStream lines_;
  std::map<std::string, MessageSeries> series_;
  std::vector<double> values_;
  std::size_t count_ = 0, damaged_ = 0;
};

// Decodes lines such as "Raw:ax,ay,az,gx,gy,gz,mx,my,mz", whose counts are in units of 1/8192 g,
// 1/16 deg/s and 0.1 uT. Lines that begin with "Uni:" contain the same quantities in m/s^2, rad/s
// and uT.
class MotionCal final : public RecordingFile::Decoder {
 public:
  explicit MotionCal(ByteSource bytes) : lines_(std::move(bytes)) { format = "motioncal"; }

  bool read(SeriesSink& sink) override {
    std::string_view line;
    if (!lines_.next(line)) {
      return false;
    }
    line = trimmed(line);
    constexpr std::size_t columns = 9;
    constexpr std::size_t prefix = 4;
    const bool is_raw = line.starts_with("Raw:");
    if (!is_raw && !line.starts_with("Uni:")) {
      others_ += line.empty() ? 0U : 1U;
      return true;
    }
    const std::vector<std::string_view> cells = split(line.substr(prefix), ',');
    values_.clear();
    for (const std::string_view cell : cells) {
      values_.push_back(parse_number(cell).value_or(not_a_number));
    }
    if (values_.size() != columns) {
      ++others_;
      return true;
    }
    if (is_raw) {
      constexpr std::array<double, 3> per_unit = {8192.0, 16.0, 10.0};
      for (std::size_t c = 0; c < columns; ++c) {
        values_[c] /= per_unit[c / 3];
      }
    }
    MessageSeries& series = is_raw ? raw_ : units_;
    if (!series.announced()) {
      series = MessageSeries(
          is_raw ? "Raw" : "Uni", 0, {"ax", "ay", "az", "gx", "gy", "gz", "mx", "my", "mz"},
          [&](const std::string& column) {
            return column[0] == 'a'   ? of_kind(SeriesKind::accelerometer, is_raw ? "g" : "m/s^2")
                   : column[0] == 'g' ? of_kind(SeriesKind::gyroscope, is_raw ? "deg/s" : "rad/s")
                                      : of_kind(SeriesKind::magnetometer, "uT");
          });
      series.announce(sink, count_);
    }
    series.put(sink, not_a_number, values_);
    return true;
  }

  std::vector<std::string> notes() const override { return left_out(others_, "are not readings"); }

 private:
  LineStream lines_;
  MessageSeries raw_, units_;
  std::vector<double> values_;
  std::size_t count_ = 0, others_ = 0;
};

}  // namespace

bool is_vectornav(std::string_view start) {
  return are_most_lines(start, [](std::string_view line) { return sentence_of(line).has_value(); });
}

bool is_motioncal(std::string_view start) {
  return are_most_lines(start, [](std::string_view line) {
    return trimmed(line).starts_with("Raw:") || trimmed(line).starts_with("Uni:");
  });
}

DecoderPointer open_vectornav(ByteSource bytes) {
  return std::make_unique<VectorNav>(std::move(bytes));
}

DecoderPointer open_motioncal(ByteSource bytes) {
  return std::make_unique<MotionCal>(std::move(bytes));
}

}  // namespace axiscal
