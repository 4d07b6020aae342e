// SPDX-License-Identifier: Apache-2.0
#include "core/json_document.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "core/formatted.hpp"
#include "core/json_pieces.hpp"

namespace axiscal {
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
    // Throws the same error as fail(), but adds the settings by which the user can avoid it.
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

}  // namespace axiscal
