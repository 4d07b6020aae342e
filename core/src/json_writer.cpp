// SPDX-License-Identifier: Apache-2.0
#include "core/json_writer.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

bool is_scalar_array(const Json& value) {
  return value.is_array() && std::none_of(value.begin(), value.end(), [](const Json& element) {
           return element.is_structured();
         });
}

void append_number(std::string& out, double number) {
  if (!std::isfinite(number)) {
    out += "null";
    return;
  }
  std::array<char, number_text_size> text;
  out.append(text.data(), write_number(text.data(), number));
}

template <typename Integer>
void append_integer(std::string& out, Integer number) {
  std::array<char, std::numeric_limits<Integer>::digits10 + 3> text;
  out.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), number).ptr);
}

void append_text(std::string& out, std::string_view text) {
  const bool plain = std::all_of(text.begin(), text.end(), [](char c) {
    return c >= ' ' && c <= '~' && c != '"' && c != '\\';
  });
  if (plain) {
    out += '"';
    out += text;
    out += '"';
  } else {
    out += Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
  }
}

void append_scalar(std::string& out, const Json& value) {
  if (value.is_number_float()) {
    append_number(out, value.get<double>());
  } else if (value.is_number_unsigned()) {
    append_integer(out, value.get<std::uint64_t>());
  } else if (value.is_number_integer()) {
    append_integer(out, value.get<std::int64_t>());
  } else if (value.is_string()) {
    append_text(out, value.get_ref<const std::string&>());
  } else {
    out += value.dump(-1, ' ', false, Json::error_handler_t::replace);
  }
}

// Appends a list on one line.
// @param append  function that appends an entry to a text.
template <typename List, typename Append>
void append_list(std::string& out, const List& list, std::string_view comma, const Append& append) {
  out += '[';
  bool is_first = true;
  for (const auto& entry : list) {
    out += is_first ? std::string_view() : comma;
    is_first = false;
    append(out, entry);
  }
  out += ']';
}

}  // namespace

void JsonWriter::new_line() {
  if (layout_ == JsonLayout::lines) {
    text_ += '\n';
    text_.append(2 * levels_.size(), ' ');
  }
}

// Separates an entry of the innermost object or list from the entry before it.
void JsonWriter::begin_entry() {
  constexpr std::size_t long_enough = std::size_t{1} << 16U;
  if (take_ && text_.size() >= long_enough) {
    take_(text_);
    text_.clear();
  }
  Level& level = levels_.back();
  text_ += level.is_empty ? "" : ",";
  level.is_empty = false;
  new_line();
}

void JsonWriter::begin_value() {
  if (!levels_.empty() && levels_.back().is_list) {
    begin_entry();
  }
}

void JsonWriter::begin(char bracket) {
  begin_value();
  text_ += bracket;
  levels_.push_back({.is_list = bracket == '['});
}

void JsonWriter::end(char bracket) {
  const bool is_empty = levels_.back().is_empty;
  levels_.pop_back();
  if (!is_empty) {
    new_line();
  }
  text_ += bracket;
}

void JsonWriter::key(std::string_view name) {
  begin_entry();
  append_text(text_, name);
  text_ += layout_ == JsonLayout::lines ? ": " : ":";
}

void JsonWriter::number(double number) {
  begin_value();
  append_number(text_, number);
}

void JsonWriter::integer(std::int64_t number) {
  begin_value();
  append_integer(text_, number);
}

void JsonWriter::flag(bool flag) {
  begin_value();
  text_ += flag ? "true" : "false";
}

void JsonWriter::text(std::string_view text) {
  begin_value();
  append_text(text_, text);
}

// NOLINTNEXTLINE(misc-no-recursion): the values that we write are a few levels deep
void JsonWriter::value(const Json& value) {
  if (is_scalar_array(value)) {
    begin_value();
    append_list(text_, value, comma(), append_scalar);
  } else if (value.is_array()) {
    begin_list();
    for (const Json& entry : value) {
      this->value(entry);
    }
    end_list();
  } else if (value.is_object()) {
    begin_object();
    for (const auto& item : value.items()) {
      key(item.key());
      this->value(item.value());
    }
    end_object();
  } else {
    begin_value();
    append_scalar(text_, value);
  }
}

void JsonWriter::numbers(const Eigen::Ref<const Eigen::VectorXd>& numbers) {
  begin_value();
  append_list(text_, numbers, comma(), append_number);
}

void JsonWriter::integers(const std::vector<int>& numbers) {
  begin_value();
  append_list(text_, numbers, comma(), append_integer<int>);
}

void JsonWriter::texts(const std::vector<std::string>& texts) {
  begin_value();
  append_list(text_, texts, comma(), append_text);
}

void JsonWriter::matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  begin_list();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    begin_value();
    append_list(text_, matrix.row(i), comma(), append_number);
  }
  end_list();
}

void JsonWriter::column(std::string_view entries, bool of_lists) {
  if (of_lists) {
    begin_list();
  } else {
    begin_value();
    text_ += '[';
  }
  bool is_first = true;
  while (!entries.empty()) {
    const std::size_t size = entries.find('\n');
    if (of_lists) {
      begin_value();
    } else {
      text_ += is_first ? std::string_view() : comma();
    }
    is_first = false;
    text_ += entries.substr(0, size);
    entries.remove_prefix(size + 1);
  }
  if (of_lists) {
    end_list();
  } else {
    text_ += ']';
  }
}

void JsonWriter::add_problem(std::string_view key, std::string_view problem) {
  if (problem_.empty()) {
    problem_.append(key).append(" ").append(problem);
  }
}

std::string JsonWriter::finish() {
  if (layout_ == JsonLayout::lines) {
    text_ += '\n';
  }
  if (take_) {
    take_(text_);
    text_.clear();
  }
  return std::move(text_);
}

std::string json_text(const Json& value) {
  JsonWriter writer;
  writer.value(value);
  return writer.finish();
}

void JsonColumns::begin_row() {
  // After 256 rows, the final size of each column is estimated, and memory of this size is
  // reserved. Growth by doubling would need twice the memory.
  constexpr std::size_t telling = 256;
  if (rows_ == telling && expected_ > telling) {
    for (Column& column : columns_) {
      column.cells.reserve(column.cells.size() / telling * expected_ * 21 / 20);
    }
  }
  ++rows_;
  at_ = 0;
}

std::string& JsonColumns::next_cell(std::string_view key, bool is_list) {
  const auto named = [&](const Column& column) { return column.name == key; };
  if (at_ >= columns_.size() || !named(columns_[at_])) {
    const auto found = std::find_if(columns_.begin(), columns_.end(), named);
    at_ = static_cast<std::size_t>(found - columns_.begin());
    if (found == columns_.end()) {
      columns_.push_back({.name = std::string(key), .cells = {}});
    }
  }
  Column& column = columns_[at_++];
  for (; column.count + 1 < rows_; ++column.count) {
    column.cells += "null\n";
  }
  ++column.count;
  column.holds_lists = column.holds_lists || is_list;
  return column.cells;
}

void JsonColumns::put_number(std::string_view key, double number) {
  std::string& cells = next_cell(key, false);
  append_number(cells, number);
  cells += '\n';
}

void JsonColumns::put_integer(std::string_view key, int number) {
  std::string& cells = next_cell(key, false);
  append_integer(cells, number);
  cells += '\n';
}

void JsonColumns::put_text(std::string_view key, std::string_view text) {
  std::string& cells = next_cell(key, false);
  append_text(cells, text);
  cells += '\n';
}

void JsonColumns::put_numbers(std::string_view key,
                              const Eigen::Ref<const Eigen::VectorXd>& numbers) {
  std::string& cells = next_cell(key, true);
  append_list(cells, numbers, layout_ == JsonLayout::lines ? ", " : ",", append_number);
  cells += '\n';
}

void JsonColumns::put_value(std::string_view key, const Json& value) {
  std::string& cells = next_cell(key, value.is_structured());
  if (is_scalar_array(value)) {
    append_list(cells, value, layout_ == JsonLayout::lines ? ", " : ",", append_scalar);
  } else {
    append_scalar(cells, value);
  }
  cells += '\n';
}

void JsonColumns::write_to(JsonWriter& writer) {
  writer.begin_object();
  for (Column& column : columns_) {
    for (; column.count < rows_; ++column.count) {
      column.cells += "null\n";
    }
    writer.key(column.name);
    writer.column(column.cells, column.holds_lists);
    column = {};
  }
  writer.end_object();
}

Json json_from(const Eigen::Ref<const Eigen::VectorXd>& vector) {
  Json list = Json::array();
  for (const double number : vector) {
    list.push_back(number);
  }
  return list;
}

Json json_from_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    rows.push_back(json_from(matrix.row(i).transpose()));
  }
  return rows;
}

}  // namespace axiscal
