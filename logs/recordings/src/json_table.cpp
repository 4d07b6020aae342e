// SPDX-License-Identifier: Apache-2.0
// JSON of readings: a list of records, a record a line, or an object of columns. Records within
// records become names with points: {"imu": {"accelerometer": {"x": 1}}} is imu.accelerometer.x.
#include <algorithm>
#include <map>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/number_text.hpp"
#include "opened.hpp"
#include "text_encoding.hpp"
#include "text_layout.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_columns = 10000;
constexpr int deepest = 16;

// A table of text cells.
struct Cells {
  std::vector<std::string> names;
  std::map<std::string, std::size_t> places;
  std::vector<std::vector<std::string>> rows;
};

std::string cell_of(const Json& value) {
  if (value.is_string()) {
    return utf8_of_latin1(value.get<std::string>());
  }
  if (value.is_number()) {
    return value.is_number_float() ? number_text(value.get<double>()) : value.dump();
  }
  return value.is_boolean() ? (value.get<bool>() ? "1" : "0") : "";
}

// NOLINTNEXTLINE(misc-no-recursion): records hold records
void add_record(const Json& value, const std::string& name, int depth, Cells& cells) {
  if (depth > deepest) {
    return;
  }
  const auto within = [&](const std::string& key) { return name.empty() ? key : name + "." + key; };
  if (value.is_object()) {
    for (const auto& [key, part] : value.items()) {
      add_record(part, within(key), depth + 1, cells);
    }
    return;
  }
  if (value.is_array()) {
    constexpr std::size_t longest = 16;
    for (std::size_t i = 0; i < std::min(value.size(), longest); ++i) {
      add_record(value[i], formatted("{}[{}]", name, i), depth + 1, cells);
    }
    return;
  }
  const auto [at, is_new] = cells.places.try_emplace(name, cells.names.size());
  if (is_new) {
    if (cells.names.size() >= most_columns) {
      return;
    }
    cells.names.push_back(name);
  }
  std::vector<std::string>& row = cells.rows.back();
  row.resize(std::max(row.size(), at->second + 1));
  row[at->second] = cell_of(value);
}

std::string csv_of(const Cells& cells) {
  std::string text;
  const auto add_row = [&](const std::vector<std::string>& row) {
    for (std::size_t c = 0; c < cells.names.size(); ++c) {
      text += (c > 0 ? "," : "") + (c < row.size() ? csv_cell(row[c]) : std::string());
    }
    text += '\n';
  };
  add_row(cells.names);
  for (const std::vector<std::string>& row : cells.rows) {
    add_row(row);
  }
  return text;
}

OpenedFile table_of(const std::string& path, const std::string& name, const std::string& text) {
  OpenedFile opened{.format = "json", .table_name = name};
  opened.text = bytes_of_text(path, text);
  return opened;
}

// An object whose members are lists of one length.
bool are_columns(const Json& json) {
  return json.is_object() && !json.empty() &&
         std::all_of(json.begin(), json.end(), [&](const Json& column) {
           return column.is_array() && !column.empty() && column.size() == json.begin()->size();
         });
}

std::vector<Json> records_of(const std::string& path, const std::string& text) {
  Json json = json_or_discarded(text);
  if (!json.is_discarded()) {
    if (json.is_object() && json.contains("columns") && json.contains("data") &&
        json["columns"].is_array() && json["data"].is_array()) {  // pandas, orient="split"
      std::vector<Json> records;
      for (const Json& row : json["data"]) {
        Json record = Json::object();
        for (std::size_t c = 0; c < std::min(row.size(), json["columns"].size()); ++c) {
          record[cell_of(json["columns"][c])] = row[c];
        }
        records.push_back(std::move(record));
      }
      return records;
    }
    if (json.is_object() && !are_columns(json)) {
      // The records may lie within: {"data": [{...}, ...]}.
      for (const auto& [key, part] : json.items()) {
        if (part.is_array() && part.size() > 1 && part.front().is_object()) {
          Json inner = part;
          return {inner.begin(), inner.end()};
        }
      }
    }
    if (json.is_array()) {
      return {json.begin(), json.end()};
    }
    return {json};
  }
  std::vector<Json> records;
  std::size_t line = 0;
  for (const std::string_view part : split(text, '\n')) {
    ++line;
    if (trimmed(part).empty() || trimmed(part) == "\r") {
      continue;
    }
    Json record = json_or_discarded(part);
    if (record.is_discarded()) {
      throw DataError(path, line, "is no JSON: neither a whole file of it nor a record a line");
    }
    records.push_back(std::move(record));
  }
  return records;
}

}  // namespace

OpenedFile open_json(ByteSource bytes) {
  const std::string path = bytes.path();
  const std::string text = read_up_to(largest_whole_file + 1, [&](char* buffer, std::size_t size) {
    return bytes.read(buffer, size);
  });
  if (text.size() > largest_whole_file) {
    throw DataError(path, "JSON of more than 256 MiB; save it as CSV");
  }
  const std::vector<Json> records = records_of(path, text);
  if (records.size() == 1 && are_columns(records.front())) {
    Cells cells;
    const Json& columns = records.front();
    for (std::size_t row = 0; row < columns.begin()->size(); ++row) {
      cells.rows.emplace_back();
      for (const auto& [key, column] : columns.items()) {
        add_record(column[row], key, 0, cells);
      }
    }
    return table_of(path, stem_of(path), csv_of(cells));
  }
  // Sensor Logger states of each record which sensor it is of; each is a table.
  std::map<std::string, Cells> tables;
  std::vector<std::string> order;
  for (const Json& record : records) {
    if (!record.is_object() && !record.is_array()) {
      continue;
    }
    const bool has_sensor =
        record.is_object() && record.contains("sensor") && record["sensor"].is_string();
    const std::string sensor = has_sensor ? record["sensor"].get<std::string>() : "";
    if (!tables.contains(sensor)) {
      constexpr std::size_t most_tables = 256;
      if (tables.size() >= most_tables) {
        continue;
      }
      order.push_back(sensor);
    }
    Cells& cells = tables[sensor];
    cells.rows.emplace_back();
    add_record(record, "", 0, cells);
  }
  if (order.empty()) {
    throw DataError(path, "the JSON holds no record");
  }
  if (order.size() == 1) {
    return table_of(path, order.front().empty() ? stem_of(path) : order.front(),
                    csv_of(tables.begin()->second));
  }
  std::vector<OpenedFile> opened;
  std::string why;
  for (const std::string& sensor : order) {
    try {
      opened.push_back(
          table_of(path, sensor.empty() ? stem_of(path) : sensor, csv_of(tables[sensor])));
      read_table(opened.back(), {});
    } catch (const DataError& error) {
      opened.pop_back();
      why = error.what();
    }
  }
  if (opened.empty()) {
    throw DataError(path, "the JSON holds no table of numbers: " + why);
  }
  OpenedFile all = joined_recordings(std::move(opened));
  all.format = "sensorlogger";  // which writes them so
  all.decoder->format = all.format;
  return all;
}

}  // namespace axiscal
