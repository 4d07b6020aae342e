// SPDX-License-Identifier: Apache-2.0
// Flight logs as text. ArduPilot's .log has lines `NAME, value, value`; FMT lines name the columns.
// mavlogdump prints lines `date time: NAME {field : value, ...}`, or JSON lines {"meta": {"type":
// NAME, "timestamp": s}, "data": {field: value, ...}}.
#include <algorithm>

#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "logs/recordings/src/flight_messages.hpp"
#include "logs/recordings/src/line_stream.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_messages = 4096;

class DataflashText final : public RecordingFile::Decoder {
 public:
  explicit DataflashText(ByteSource bytes) : lines_(std::move(bytes)) { format = "dataflash-text"; }

  bool read(SeriesSink& sink) override {
    std::string_view line;
    if (!lines_.next(line)) {
      return false;
    }
    const std::vector<std::string_view> cells = split(line, ',');
    if (cells.front() == "FMT") {
      take_format(cells);
      return true;
    }
    const auto known = messages_.find(std::string(cells.front()));
    if (known == messages_.end()) {
      other_ += trimmed(line).empty() ? 0U : 1U;
      return true;
    }
    if (cells.size() != known->second.places.size() + 1) {
      ++damaged_;
      return true;
    }
    if (known->first == "PARM" && cells.size() >= 3) {
      facts[std::string(cells[cells.size() - 2])] = cells.back();
      return true;
    }
    values_.clear();
    for (std::size_t c = 1; c < cells.size(); ++c) {
      if (known->second.places[c - 1]) {
        values_.push_back(parse_number(cells[c]).value_or(not_a_number));
      }
    }
    known->second.flight.put(sink, values_, count_);
    return true;
  }

  std::vector<std::string> notes() const override {
    std::vector<std::string> all;
    if (other_ > 0) {
      all.push_back(formatted("{} lines are not messages and are left out", other_));
    }
    if (damaged_ > 0) {
      all.push_back(
          formatted("{} lines are left out, because their number of fields differs from the "
                    "definition of the message",
                    damaged_));
    }
    return all;
  }

 private:
  struct Message {
    std::vector<bool> places;  // true for each field that is a number
    FlightMessage flight;
  };

  // Reads a definition of a message: "FMT, 128, 89, IMU, Iffffff, TimeMS,GyrX,...".
  void take_format(const std::vector<std::string_view>& cells) {
    constexpr std::size_t first_column = 5;
    if (cells.size() <= first_column || messages_.size() >= most_messages) {
      return;
    }
    Message message;
    std::vector<std::string> fields;
    for (std::size_t c = first_column; c < cells.size(); ++c) {
      const std::size_t f = c - first_column;
      const bool is_number = f >= cells[4].size() ||
                             std::string_view("nNZa").find(cells[4][f]) == std::string_view::npos;
      message.places.push_back(is_number);
      if (is_number) {
        fields.emplace_back(cells[c]);
      }
    }
    const std::string name(cells[3]);
    message.flight = FlightMessage(name, fields);
    messages_.try_emplace(name, std::move(message));
  }

  LineStream lines_;
  std::map<std::string, Message> messages_;
  std::vector<double> values_;
  std::size_t count_ = 0, other_ = 0, damaged_ = 0;
};

// The parts of "2017-09-10 10:49:22.70: IMU {TimeUS : 402644506, GyrX : -0.07}".
struct DumpedLine {
  std::string_view time, name, fields;
};

std::optional<DumpedLine> dumped_line(std::string_view line) {
  const std::size_t open = line.find(" {");
  const std::size_t colon = line.find(": ");
  if (open == std::string_view::npos || colon == std::string_view::npos || colon > open ||
      !trimmed(line).ends_with('}')) {
    return std::nullopt;
  }
  const DumpedLine parts{.time = line.substr(0, colon),
                         .name = trimmed(line.substr(colon + 2, open - colon - 2)),
                         .fields = line.substr(open + 2, line.rfind('}') - open - 2)};
  const bool is_name =
      !parts.name.empty() && parts.name.find_first_of(" ,:{}") == std::string_view::npos;
  return is_name ? std::optional(parts) : std::nullopt;
}

// The message in a line.
struct DumpedMessage {
  std::string name;
  std::vector<std::string> fields;
  std::vector<double> values;
  std::optional<double> time_s;
};

std::optional<DumpedMessage> message_of_text(std::string_view line) {
  const std::optional<DumpedLine> parts = dumped_line(line);
  if (!parts) {
    return std::nullopt;
  }
  DumpedMessage message{.name = std::string(parts->name), .time_s = parse_timestamp(parts->time)};
  for (const std::string_view field : split(parts->fields, ',')) {
    const std::size_t colon = field.find(" : ");
    if (colon == std::string_view::npos) {
      continue;
    }
    const std::string_view cell = trimmed(field.substr(colon + 3));
    const std::optional<double> value = parse_number(cell);
    if (value || cell == "nan") {
      message.fields.emplace_back(trimmed(field.substr(0, colon)));
      message.values.push_back(value.value_or(not_a_number));
    }
  }
  return message;
}

std::optional<DumpedMessage> message_of_json(std::string_view line) {
  const Json json = Json::parse(line, nullptr, false);
  const auto is_object = [](const Json& value, const char* name) {
    return value.is_object() && value.contains(name) && value[name].is_object();
  };
  if (!is_object(json, "meta") || !is_object(json, "data")) {
    return std::nullopt;
  }
  const Json& meta = json["meta"];
  if (!meta.contains("type") || !meta["type"].is_string()) {
    return std::nullopt;
  }
  DumpedMessage message{.name = meta["type"].get<std::string>()};
  if (meta.contains("timestamp") && meta["timestamp"].is_number()) {
    message.time_s = meta["timestamp"].get<double>();
  }
  for (const auto& [field, value] : json["data"].items()) {
    if (value.is_number() || value.is_null()) {  // null means NaN
      message.fields.push_back(field);
      message.values.push_back(value.is_null() ? not_a_number : value.get<double>());
    }
  }
  return message;
}

std::optional<DumpedMessage> dumped_message(std::string_view line) {
  return trimmed(line).starts_with('{') ? message_of_json(line) : message_of_text(line);
}

class MavlinkText final : public RecordingFile::Decoder {
 public:
  explicit MavlinkText(ByteSource bytes) : lines_(std::move(bytes)) { format = "mavlink-text"; }

  bool read(SeriesSink& sink) override {
    std::string_view line;
    if (!lines_.next(line)) {
      return false;
    }
    const std::optional<DumpedMessage> message = dumped_message(line);
    if (!message) {
      other_ += trimmed(line).empty() ? 0U : 1U;
      return true;
    }
    auto known = messages_.find(message->name);
    if (known == messages_.end()) {
      if (message->fields.empty() || messages_.size() >= most_messages) {
        return true;
      }
      known = messages_.emplace(message->name, FlightMessage(message->name, message->fields)).first;
    }
    if (known->second.fields() != message->fields) {
      ++other_;
      return true;
    }
    known->second.put(sink, message->values, count_, message->time_s);
    return true;
  }

  std::vector<std::string> notes() const override {
    return other_ > 0 ? std::vector{formatted("{} lines are not messages and are left out", other_)}
                      : std::vector<std::string>{};
  }

 private:
  LineStream lines_;
  std::map<std::string, FlightMessage> messages_;
  std::size_t count_ = 0, other_ = 0;
};

}  // namespace

bool is_dataflash_text(std::string_view start) {
  const std::vector<std::string_view> lines = first_lines(start, true);
  return std::any_of(lines.begin(), lines.end(), [](std::string_view line) {
    return line.starts_with("FMT, 128, ") || line.starts_with("FMT,128,");
  });
}

bool is_mavlink_text(std::string_view start) {
  constexpr std::size_t looked_at = 5;
  const std::vector<std::string_view> lines = first_lines(start, true, looked_at);
  return std::any_of(lines.begin(), lines.end(), [](std::string_view line) {
    const std::optional<DumpedMessage> message = dumped_message(line);
    return message && (!message->fields.empty() || trimmed(line).starts_with('{'));
  });
}

DecoderPointer open_dataflash_text(ByteSource bytes) {
  return std::make_unique<DataflashText>(std::move(bytes));
}

DecoderPointer open_mavlink_text(ByteSource bytes) {
  return std::make_unique<MavlinkText>(std::move(bytes));
}

}  // namespace axiscal
