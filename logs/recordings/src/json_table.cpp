// SPDX-License-Identifier: Apache-2.0
// Reads tables in JSON: a list of records, lines with one record each, or an object with one list
// for each column. Names within nested records are joined with points: {"imu": {"accelerometer":
// {"x": 1}}} has the column imu.accelerometer.x.
#include <algorithm>
#include <map>
#include <unordered_map>
#include <utility>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "core/json_pieces.hpp"
#include "logs/recordings/src/opened.hpp"
#include "logs/recordings/src/text_encoding.hpp"
#include "logs/recordings/src/text_layout.hpp"

namespace axiscal {
namespace {

constexpr int deepest = 16;

// A table in which later rows may add columns. Each row is stored as text that ends with its last
// filled cell. The empty cells after it are added when the table is read.
class GrowingTable {
 public:
  explicit GrowingTable(ReadBudget budget) : budget_(std::move(budget)) {}

  void add_row(const std::vector<std::pair<std::string, std::string>>& cells) {
    row_.assign(row_.size(), {});
    std::size_t filled = 0;
    for (const auto& [name, text] : cells) {
      const auto [at, is_new] = places_.try_emplace(name, names_.size());
      if (is_new) {
        names_.push_back(name);
        row_.emplace_back();
      }
      row_[at->second] = csv_cell(text);
      filled = std::max(filled, at->second + 1);
    }
    const std::size_t before = text_.size();
    for (std::size_t c = 0; c < filled; ++c) {
      text_ += c > 0 ? "," : "";
      text_ += row_[c];
    }
    rows_.push_back({.size = text_.size() - before, .cells = filled});
    budget_.spend(ReadCost::cells, filled);
    // Growing text_ and rows_ may need twice their size.
    budget_.spend(ReadCost::memory, 2 * (rows_.back().size + sizeof(Row)));
  }

  // @throws DataError if no record contained a value.
  [[nodiscard]] ByteSource text(const std::string& path) && {
    if (names_.empty()) {
      throw DataError(path, "the records of the JSON contain no values");
    }
    const ReadBudget budget = budget_;
    for (const Row& row : rows_) {
      budget.spend(ReadCost::cells, names_.size() - row.cells);
    }
    auto table = std::make_shared<GrowingTable>(std::move(*this));
    return bytes_of_pieces(
        path, [table](std::string& line) { return table->next(line); }, budget);
  }

 private:
  struct Row {
    std::size_t size, cells;
  };

  // Writes the next line of the table to `line`: first the header, and then the rows.
  // @return false at the end.
  bool next(std::string& line) {
    if (!has_header_) {
      has_header_ = true;
      for (const std::string& name : names_) {
        line += (&name == &names_.front() ? "" : ",") + csv_cell(name);
      }
    } else if (next_ < rows_.size()) {
      const Row& row = rows_[next_++];
      line.append(text_, begin_, row.size);
      line.append(names_.size() - std::max<std::size_t>(row.cells, 1), ',');
      begin_ += row.size;
    } else {
      return false;
    }
    line += '\n';
    return true;
  }

  ReadBudget budget_;
  std::vector<std::string> names_;
  std::unordered_map<std::string, std::size_t> places_;
  std::vector<std::string> row_;  // cells of the row that add_row() is adding
  std::string text_;
  std::vector<Row> rows_;
  // State of next(). has_header_ is true after the header was written, next_ is the next row, and
  // begin_ is the position of this row in text_.
  bool has_header_ = false;
  std::size_t next_ = 0, begin_ = 0;
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

using Cells = std::vector<std::pair<std::string, std::string>>;

// NOLINTNEXTLINE(misc-no-recursion): records contain records
void add_cells(const Json& value, const std::string& name, int depth, Cells& cells) {
  if (depth > deepest) {
    return;
  }
  if (value.is_object()) {
    for (const auto& [key, part] : value.items()) {
      add_cells(part, name.empty() ? key : name + "." + key, depth + 1, cells);
    }
  } else if (value.is_array()) {
    constexpr std::size_t longest = 16;
    for (std::size_t i = 0; i < std::min(value.size(), longest); ++i) {
      add_cells(value[i], formatted("{}[{}]", name, i), depth + 1, cells);
    }
  } else {
    cells.emplace_back(name, cell_of(value));
  }
}

// Calls a function for each record of a JSON text.
class JsonRecords {
 public:
  using Take = std::function<void(const Json& record)>;

  JsonRecords(const std::string& path, std::string_view text) : path_(path), text_(text) {
    if (text_.starts_with("\xEF\xBB\xBF")) {
      text_.remove_prefix(3);
    }
  }

  void for_each(const Take& take) const {
    if (!is_one_value()) {
      for_each_line(take);
      return;
    }
    JsonEntries entries(text_);
    if (entries.is_list()) {
      for_each_entry(entries, take);
      return;
    }
    std::string_view names, rows, records;
    while (entries.next()) {
      const bool is_list = JsonEntries(entries.value()).is_list();
      names = is_list && entries.key() == "columns" ? entries.value() : names;
      rows = is_list && entries.key() == "data" ? entries.value() : rows;
      if (records.empty() && is_list && are_records(entries.value())) {
        records = entries.value();
      }
    }
    if (!entries.ok()) {
      fail(entries.rest());
    }
    if (!names.empty() && !rows.empty()) {  // written by pandas with orient="split"
      for_each_split(parsed(names), JsonEntries(rows), take);
    } else if (const std::optional<std::size_t> count = rows_of_columns()) {
      for_each_of_columns(*count, take);
    } else if (!records.empty()) {  // a list within an object: {"data": [{...}, ...]}
      for_each_entry(JsonEntries(records), take);
    } else {
      take(parsed(text_));
    }
  }

 private:
  [[noreturn]] void fail(std::string_view at) const {
    const auto before = static_cast<std::size_t>(at.data() - text_.data());
    const auto line =
        1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(before), '\n');
    throw DataError(path_, static_cast<std::size_t>(line),
                    "is not JSON: neither one document nor one record per line");
  }

  [[nodiscard]] Json parsed(std::string_view piece) const {
    Json value = json_or_discarded(piece);
    if (value.is_discarded()) {
      fail(piece);
    }
    return value;
  }

  // @return false if the text is not one JSON value; it may then contain one record per line.
  [[nodiscard]] bool is_one_value() const {
    JsonEntries entries(text_);
    while (entries.next()) {
    }
    return entries.ok() && entries.rest().find_first_not_of(" \t\r\n") == std::string_view::npos;
  }

  void for_each_line(const Take& take) const {
    for (std::size_t at = 0; at < text_.size();) {
      const std::size_t end = std::min(text_.find('\n', at), text_.size());
      const std::string_view line = without_returns(text_.substr(at, end - at));
      if (!trimmed(line).empty()) {
        take(parsed(line));
      }
      at = end + 1;
    }
  }

  void for_each_entry(JsonEntries entries, const Take& take) const {
    while (entries.next()) {
      take(parsed(entries.value()));
    }
  }

  void for_each_split(const Json& names, JsonEntries rows, const Take& take) const {
    while (rows.next()) {
      const Json row = parsed(rows.value());
      Json record = Json::object();
      for (std::size_t c = 0; c < std::min(row.size(), names.size()); ++c) {
        record[cell_of(names[c])] = row[c];
      }
      take(record);
    }
  }

  // @return true if a list has at least two entries, and the first one is an object.
  static bool are_records(std::string_view list) {
    JsonEntries entries(list);
    return entries.next() && JsonEntries(entries.value()).is_object() && entries.next();
  }

  // @return the number of rows if the text is an object of columns, which means that it contains
  //         only lists of the same length; otherwise nullopt.
  [[nodiscard]] std::optional<std::size_t> rows_of_columns() const {
    std::optional<std::size_t> rows;
    JsonEntries columns(text_);
    while (columns.next()) {
      JsonEntries entries(columns.value());
      std::size_t count = 0;
      if (!entries.is_list()) {
        return std::nullopt;
      }
      while (entries.next()) {
        ++count;
      }
      if (!entries.ok() || count == 0 || count != rows.value_or(count)) {
        return std::nullopt;
      }
      rows = count;
    }
    return rows;
  }

  void for_each_of_columns(std::size_t count, const Take& take) const {
    std::vector<std::pair<std::string, JsonEntries>> columns;
    for (JsonEntries all(text_); all.next();) {
      const std::string quoted = "\"" + std::string(all.key()) + "\"";
      columns.emplace_back(parsed_key(quoted, all.key()), JsonEntries(all.value()));
    }
    for (std::size_t row = 0; row < count; ++row) {
      Json record = Json::object();
      for (auto& [name, entries] : columns) {
        entries.next();
        record.emplace(name, parsed(entries.value()));
      }
      take(record);
    }
  }

  [[nodiscard]] std::string parsed_key(const std::string& quoted, std::string_view key) const {
    const Json name = json_or_discarded(quoted);
    if (!name.is_string()) {
      fail(key);
    }
    return name.get<std::string>();
  }

  const std::string& path_;
  std::string_view text_;
};

OpenedFile table_of(const std::string& path, const std::string& name, GrowingTable table) {
  OpenedFile opened{.format = "json", .table_name = name};
  opened.text = std::move(table).text(path);
  return opened;
}

}  // namespace

OpenedFile open_json(ByteSource bytes) {
  const std::string path = bytes.path();
  const ReadBudget budget = bytes.budget();
  std::string text = read_up_to(largest_whole_file + 1, [&](char* buffer, std::size_t size) {
    return bytes.read(buffer, size);
  });
  if (text.size() > largest_whole_file) {
    throw DataError(path, "is JSON of more than 256 MiB; save it as CSV");
  }
  budget.spend(ReadCost::memory, 2 * text.size());  // a growing string may need twice its size
  // In files of the app Sensor Logger, each record names its sensor. The records of each sensor
  // form one table.
  std::map<std::string, GrowingTable> tables;
  std::vector<std::string> order;
  Cells cells;
  JsonRecords(path, text).for_each([&](const Json& record) {
    if (!record.is_object() && !record.is_array()) {
      return;
    }
    const bool has_sensor =
        record.is_object() && record.contains("sensor") && record["sensor"].is_string();
    const std::string sensor = has_sensor ? record["sensor"].get<std::string>() : "";
    if (!tables.contains(sensor)) {
      budget.spend(ReadCost::members, 1.0);
      order.push_back(sensor);
      tables.emplace(sensor, GrowingTable(budget));
    }
    cells.clear();
    add_cells(record, "", 0, cells);
    tables.at(sensor).add_row(cells);
  });
  text = {};
  if (order.empty()) {
    throw DataError(path, "the JSON contains no records");
  }
  if (order.size() == 1) {
    return table_of(path, order.front().empty() ? stem_of(path) : order.front(),
                    std::move(tables.begin()->second));
  }
  std::vector<OpenedFile> opened;
  std::string why;
  for (const std::string& sensor : order) {
    try {
      opened.push_back(
          table_of(path, sensor.empty() ? stem_of(path) : sensor, std::move(tables.at(sensor))));
      read_table(opened.back(), {});
    } catch (const LimitError&) {
      throw;
    } catch (const DataError& error) {
      opened.pop_back();
      why = error.what();
    }
  }
  if (opened.empty()) {
    throw DataError(path, "the JSON contains no table of numbers: " + why);
  }
  OpenedFile all = joined_recordings(std::move(opened));
  all.format = "sensorlogger";  // only Sensor Logger's records name a sensor
  all.decoder->format = all.format;
  return all;
}

}  // namespace axiscal
