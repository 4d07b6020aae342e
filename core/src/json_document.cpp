// SPDX-License-Identifier: Apache-2.0
#include "core/json_document.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "core/json_pieces.hpp"

namespace axiscal {
namespace {

bool is_scalar_array(const Json& value) {
  return std::none_of(value.begin(), value.end(),
                      [](const Json& element) { return element.is_structured(); });
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

// Collects the text that is written. If `take` is not null, it receives the text in pieces;
// otherwise `out` keeps the whole text.
struct JsonSink {
  std::string& out;
  const TakeText* take = nullptr;

  void pass_on() const {
    constexpr std::size_t long_enough = std::size_t{1} << 16U;
    if (take != nullptr && out.size() >= long_enough) {
      (*take)(out);
      out.clear();
    }
  }
};

// The subtype of a binary JSON value that stores a column of a table. The bytes of the value are
// the texts of the cells; a line feed ends each cell.
enum class ColumnOf : std::uint8_t { scalars, lists };

void append_column(const JsonSink& sink, const Json::binary_t& column, std::size_t indent) {
  std::string& out = sink.out;
  const bool lists = column.subtype() == static_cast<std::uint8_t>(ColumnOf::lists);
  const std::string between = lists ? ",\n" + std::string(indent + 2, ' ') : ", ";
  out += '[';
  out += lists ? std::string_view(between).substr(1) : "";
  for (auto cell = column.begin(); cell != column.end();) {
    const auto end = std::find(cell, column.end(), '\n');
    out.append(cell, end);
    cell = end + 1;
    out += cell != column.end() ? std::string_view(between) : "";
    sink.pass_on();
  }
  if (lists) {
    out += '\n';
    out.append(indent, ' ');
  }
  out += ']';
}

// NOLINTNEXTLINE(misc-no-recursion): as append()
std::size_t size_of_columns(const Json& value) {
  if (value.is_binary()) {
    return value.get_binary().size();
  }
  std::size_t sum = 0;
  if (value.is_object()) {
    for (const Json& child : value) {
      sum += size_of_columns(child);
    }
  }
  return sum;
}

// Appends the value's text. If `value` is not const, each column is emptied after its text is
// appended, so that memory does not contain the column twice.
// NOLINTNEXTLINE(misc-no-recursion): the records that we write are a few levels deep
template <typename AnyJson>
void append(const JsonSink& sink, AnyJson& value, std::size_t indent) {
  std::string& out = sink.out;
  if (value.is_binary()) {
    append_column(sink, value.get_binary(), indent);
    if constexpr (!std::is_const_v<AnyJson>) {
      value = Json::array();
    }
    return;
  }
  if (!value.is_structured()) {
    append_scalar(out, value);
    return;
  }
  const bool object = value.is_object();
  if (value.empty() || (!object && is_scalar_array(value))) {
    out += object ? '{' : '[';
    for (std::size_t i = 0; i < value.size(); ++i) {
      out += i == 0 ? "" : ", ";
      append_scalar(out, value[i]);
    }
    out += object ? '}' : ']';
    return;
  }
  out += object ? "{\n" : "[\n";
  bool first = true;
  for (auto& item : value.items()) {
    out += first ? "" : ",\n";
    first = false;
    out.append(indent + 2, ' ');
    if (object) {
      append_text(out, item.key());
      out += ": ";
    }
    append(sink, item.value(), indent + 2);
    sink.pass_on();
  }
  out += '\n';
  out.append(indent, ' ');
  out += object ? '}' : ']';
}

}  // namespace

namespace {

std::string escaped(std::string_view name) {
  std::string step;
  for (const char c : name) {
    step += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  }
  return step;
}

// Returns the JSON pointer from `root` to a value in it. The search is not recursive, because a
// file may be nested deeply.
std::string way_to(const Json& value, const Json& root) {
  struct Level {
    const Json* parent;
    Json::const_iterator child;
  };
  std::vector<Level> levels;
  const Json* at = &root;
  while (at != &value) {
    if (at->is_structured()) {
      levels.push_back({at, at->begin()});
    } else if (!levels.empty()) {
      ++levels.back().child;
    }
    while (!levels.empty() && levels.back().child == levels.back().parent->end()) {
      levels.pop_back();
      if (!levels.empty()) {
        ++levels.back().child;
      }
    }
    if (levels.empty()) {
      return "";
    }
    at = &*levels.back().child;
  }
  std::string way;
  for (const Level& level : levels) {
    way += "/" + (level.parent->is_object() ? escaped(level.child.key())
                                            : formatted("{}", level.child - level.parent->begin()));
  }
  return way;
}

}  // namespace

JsonValue::JsonValue(Json document, std::string path)
    : file_(std::make_shared<const File>(File{std::move(document), std::move(path)})),
      value_(&file_->root) {}

std::string JsonValue::pointer() const {
  return way_to(*value_, file_->root) + (row_ ? formatted("/{}", *row_) : "");
}

std::optional<JsonValue> JsonValue::find(std::string_view key) const {
  require_object();
  const auto found = value_->find(key);
  if (found == value_->end()) {
    return std::nullopt;
  }
  const Json& value = row_ ? (*found)[*row_] : *found;
  return value.is_null() ? std::nullopt : std::optional(child(value));
}

JsonValue JsonValue::at(std::string_view key) const {
  std::optional<JsonValue> value = find(key);
  if (!value) {
    throw DataError(path(), pointer() + "/" + escaped(key), "is missing");
  }
  return *std::move(value);
}

void JsonValue::require_list() const {
  if (!value_->is_array()) {
    fail("must be a list");
  }
}

void JsonValue::require_object() const {
  if (!value_->is_object()) {
    fail("must be an object");
  }
}

std::vector<JsonValue> JsonValue::elements() const {
  require_list();
  std::vector<JsonValue> values;
  values.reserve(value_->size());
  for (const Json& value : *value_) {
    values.push_back(child(value));
  }
  return values;
}

void JsonValue::for_each_row(const std::function<void(const JsonValue&)>& take) const {
  if (!value_->is_object()) {
    for (const JsonValue& element : elements()) {
      take(element);
    }
    return;
  }
  std::optional<std::size_t> count;
  for (const Json& column : *value_) {
    child(column).require_list();
    if (count && *count != column.size()) {
      child(column).fail(
          formatted("has {} entries, but the first column has {}", column.size(), *count));
    }
    count = column.size();
  }
  for (std::size_t i = 0; i < count.value_or(0); ++i) {
    take({file_, *value_, i});
  }
}

double JsonValue::number() const {
  if (!value_->is_number()) {
    fail("must be a number");
  }
  const double number = value_->get<double>();
  if (!std::isfinite(number)) {
    fail("must be a finite number");
  }
  return number;
}

double JsonValue::number_or_nan() const {
  return value_->is_null() ? not_a_number : number();
}

int JsonValue::integer() const {
  const double value = number();
  if (value != std::floor(value) || std::abs(value) > std::numeric_limits<int>::max()) {
    fail("must be a whole number");
  }
  return static_cast<int>(value);
}

std::size_t JsonValue::count() const {
  const double value = number();
  constexpr double most = 9007199254740992.0;  // 2^53; doubles represent all whole numbers up to it
  if (value != std::floor(value) || value < 0.0 || value > most) {
    fail("must be a whole number, 0 or more");
  }
  return static_cast<std::size_t>(value);
}

bool JsonValue::boolean() const {
  if (!value_->is_boolean()) {
    fail("must be true or false");
  }
  return value_->get<bool>();
}

std::string JsonValue::text() const {
  if (!value_->is_string()) {
    fail("must be a string");
  }
  return value_->get<std::string>();
}

std::vector<std::string> JsonValue::texts() const {
  std::vector<std::string> texts;
  for (const JsonValue& element : elements()) {
    texts.push_back(element.text());
  }
  return texts;
}

std::vector<std::string> JsonValue::keys() const {
  require_object();
  std::vector<std::string> names;
  for (const auto& item : value_->items()) {
    names.push_back(item.key());
  }
  return names;
}

std::string JsonValue::text_or(std::string_view key, const std::string& otherwise) const {
  const std::optional<JsonValue> value = find(key);
  return value ? value->text() : otherwise;
}

Eigen::VectorXd JsonValue::numbers(std::optional<Eigen::Index> size, bool null_is_nan) const {
  require_list();
  const auto count = static_cast<Eigen::Index>(value_->size());
  if (size && *size != count) {
    fail(formatted("must have {} numbers, not {}", *size, count));
  }
  Eigen::VectorXd numbers(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Json& entry = (*value_)[static_cast<std::size_t>(i)];
    if (entry.is_null() && null_is_nan) {
      numbers(i) = not_a_number;
    } else if (entry.is_number() && std::isfinite(entry.get<double>())) {
      numbers(i) = entry.get<double>();
    } else {
      numbers(i) = child(entry).number();  // number() throws the error
    }
  }
  return numbers;
}

Eigen::MatrixXd JsonValue::grid(Eigen::Index rows, Eigen::Index columns, bool null_is_nan) const {
  const std::vector<JsonValue> values = elements();
  if (static_cast<Eigen::Index>(values.size()) != rows) {
    fail(formatted("must have {} rows, not {}", rows, values.size()));
  }
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    matrix.row(i) = values[static_cast<std::size_t>(i)].numbers(columns, null_is_nan);
  }
  return matrix;
}

Eigen::VectorXd JsonValue::vector(std::optional<Eigen::Index> size) const {
  return numbers(size, false);
}

Eigen::VectorXd JsonValue::vector_or_nan(std::optional<Eigen::Index> size) const {
  return numbers(size, true);
}

Eigen::MatrixXd JsonValue::matrix(Eigen::Index rows, Eigen::Index columns) const {
  return grid(rows, columns, false);
}

Eigen::MatrixXd JsonValue::matrix_or_nan(Eigen::Index rows, Eigen::Index columns) const {
  return grid(rows, columns, true);
}

void JsonValue::allow_keys(std::span<const std::string_view> keys) const {
  require_object();
  for (const auto& item : value_->items()) {
    if (std::find(keys.begin(), keys.end(), item.key()) == keys.end()) {
      child(item.value()).fail("unknown key" + did_you_mean(item.key(), keys));
    }
  }
}

void JsonValue::require_format(std::string_view format, int last_version) const {
  const JsonValue stated = at("format");
  if (stated.text() != format) {
    stated.fail(formatted("must be \"{}\", not \"{}\"", format, stated.text()));
  }
  const JsonValue version = at("version");
  const int number = version.integer();
  if (number < 1 || number > last_version) {
    version.fail(formatted("version {} is not supported, only {}{}", number,
                           last_version == 1 ? "1" : formatted("1 to {}", last_version),
                           number > 1 ? "; a newer version of axiscal wrote the file" : ""));
  }
}

void JsonValue::check(const std::function<void()>& check_value) const {
  try {
    check_value();
  } catch (const DomainError& error) {
    // Throws as fail() does, and adds the settings that would remedy the error.
    const std::string where = pointer();
    throw DataError(path(), (where.empty() ? "/" : where) + ": " + error.what(), error.settings());
  }
}

void JsonValue::fail(std::string_view what) const {
  throw DataError(path(), pointer(), what);
}

namespace {

// The largest allowed depth of nesting. It is limited because copying a value makes one recursive
// call for each level.
constexpr std::size_t deepest = 1000;

}  // namespace

Json json_or_discarded(std::string_view text) {
  return depth_of_json(text) > deepest ? Json(Json::value_t::discarded)
                                       : Json::parse(text.begin(), text.end(), nullptr, false);
}

JsonValue parse_json(std::string_view text, std::string path) {
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.remove_prefix(3);
  }
  if (depth_of_json(text) > deepest) {
    throw DataError(path, formatted("is nested more than {} levels deep", deepest));
  }
  try {
    return {Json::parse(text.begin(), text.end()), path};
  } catch (const Json::parse_error& error) {
    const std::string_view before = text.substr(0, error.byte == 0 ? 0 : error.byte - 1);
    const auto line = 1 + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
    std::string_view reason = error.what();
    const std::size_t colon = reason.find(": ");  // end of "[json.exception...] ... column N"
    reason.remove_prefix(colon == std::string_view::npos ? 0 : colon + 2);
    throw DataError(path, line, "not valid JSON: " + std::string(reason));
  } catch (const Json::exception& error) {
    throw DataError(path, std::string("cannot be used as JSON: ") + error.what());
  }
}

namespace {

// NOLINTNEXTLINE(misc-no-recursion): as append()
void put_nulls(Json& value) {
  if (value.is_structured()) {
    for (Json& child : value) {
      put_nulls(child);
    }
  } else if (value.is_number_float() && !std::isfinite(value.get<double>())) {
    value = nullptr;
  }
}

}  // namespace

JsonValue json_round_trip(Json value, std::string path) {
  put_nulls(value);
  return {std::move(value), std::move(path)};
}

std::string json_text(Json& value) {
  std::string out;
  // Reserves memory for a long file. Most of a long file consists of columns.
  constexpr std::size_t others = std::size_t{1} << 16U;
  if (const std::size_t columns = size_of_columns(value); columns > others) {
    out.reserve(columns + columns / 4 + others);
  }
  append(JsonSink{out}, value, 0);
  out += '\n';
  return out;
}

void put_json(Json& value, const TakeText& take) {
  std::string out;
  append(JsonSink{out, &take}, value, 0);
  out += '\n';
  take(out);
}

void JsonColumns::begin_row() {
  // After 256 rows the final size is known well enough to reserve it. Growth by doubling would need
  // twice the memory.
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
  cells += '[';
  for (Eigen::Index i = 0; i < numbers.size(); ++i) {
    cells += i == 0 ? "" : ", ";
    append_number(cells, numbers(i));
  }
  cells += "]\n";
}

void JsonColumns::put_value(std::string_view key, const Json& value) {
  std::string& cells = next_cell(key, value.is_structured());
  if (value.is_structured() && !is_scalar_array(value)) {
    cells += value.dump(-1, ' ', false, Json::error_handler_t::replace);
  } else {
    append(JsonSink{cells}, value, 0);
  }
  cells += '\n';
}

Json JsonColumns::take() {
  Json columns = Json::object();
  columns.get_ref<Json::object_t&>().reserve(columns_.size());  // growth would copy the columns
  for (Column& column : columns_) {
    for (; column.count < rows_; ++column.count) {
      column.cells += "null\n";
    }
    const auto of = column.holds_lists ? ColumnOf::lists : ColumnOf::scalars;
    columns[column.name] =
        Json::binary({column.cells.begin(), column.cells.end()}, static_cast<std::uint8_t>(of));
    column = {};
  }
  return columns;
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
