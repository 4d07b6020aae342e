// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace axiscal {

using Json = nlohmann::ordered_json;

/// A value in a JSON file together with its place, so that every complaint says where.
///
/// All accessors throw DataError `PATH: /json/pointer: ...` when the value is not what they want.
class JsonValue {
 public:
  /// The whole of a file.
  JsonValue(Json document, std::string path);

  [[nodiscard]] JsonValue at(std::string_view key) const;  ///< a needed member
  [[nodiscard]] std::optional<JsonValue> find(
      std::string_view key) const;                        ///< absent or null: none
  [[nodiscard]] std::vector<JsonValue> elements() const;  ///< an array's
  /// Rows: an array's elements, or of an object of arrays, all of one length, an object for each
  /// position, as JsonColumns took them apart.
  void for_each_row(const std::function<void(const JsonValue&)>& take) const;
  [[nodiscard]] double number() const;
  [[nodiscard]] double number_or_nan() const;  ///< null is NaN
  [[nodiscard]] int integer() const;
  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] bool boolean() const;
  [[nodiscard]] std::string text() const;
  [[nodiscard]] bool is_array() const { return value_->is_array(); }
  [[nodiscard]] bool is_object() const { return value_->is_object(); }  ///< a row is one
  [[nodiscard]] bool is_text() const { return value_->is_string(); }
  [[nodiscard]] Eigen::VectorXd vector(std::optional<Eigen::Index> size = {}) const;  ///< finite
  [[nodiscard]] Eigen::VectorXd vector_or_nan(std::optional<Eigen::Index> size = {}) const;
  [[nodiscard]] Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index columns) const;  ///< finite
  [[nodiscard]] Eigen::MatrixXd matrix_or_nan(Eigen::Index rows, Eigen::Index columns) const;
  [[nodiscard]] std::vector<std::string> texts() const;
  [[nodiscard]] std::vector<std::string> keys() const;  ///< an object's, in the file's order

  /// @return a member's text; `otherwise` where it is absent.
  [[nodiscard]] std::string text_or(std::string_view key, const std::string& otherwise = "") const;

  /// Every member must have one of these names; otherwise the nearest name is suggested.
  void allow_keys(std::span<const std::string_view> keys) const;

  /// Checks `format` and `version` (only 1 is known).
  void require_format(std::string_view format, int last_version = 1) const;

  /// Runs a check of this value; a DomainError of it becomes this value's complaint.
  void check(const std::function<void()>& check_value) const;

  /// @return the value as JSON, e.g. to be read as a file of its own.
  [[nodiscard]] std::string dump() const { return value_->dump(); }

  [[noreturn]] void fail(std::string_view what) const;
  [[nodiscard]] const std::string& path() const { return file_->path; }

 private:
  struct File {
    Json root;
    std::string path;
  };

  JsonValue(std::shared_ptr<const File> file, const Json& value, std::optional<std::size_t> row)
      : file_(std::move(file)), value_(&value), row_(row) {}

  void require_list() const;
  void require_object() const;

  // Pointer into the file (RFC 6901). It is computed only for error messages.
  [[nodiscard]] std::string pointer() const;
  [[nodiscard]] JsonValue child(const Json& value) const { return {file_, value, std::nullopt}; }
  [[nodiscard]] Eigen::VectorXd numbers(std::optional<Eigen::Index> size, bool null_is_nan) const;
  [[nodiscard]] Eigen::MatrixXd grid(Eigen::Index rows,
                                     Eigen::Index columns,
                                     bool null_is_nan) const;

  std::shared_ptr<const File> file_;
  const Json* value_;
  std::optional<std::size_t> row_;  // of the columns that the value is
};

/// @return the parsed text; a discarded value if the text is not JSON, or is nested more than 1,000
///         levels deep.
[[nodiscard]] Json json_or_discarded(std::string_view text);

/// @throws DataError  `PATH:LINE: ...` if the text is not JSON, or is nested too deep.
[[nodiscard]] JsonValue parse_json(std::string_view text, std::string path);

/// @return the value as text to read: members on lines of their own, arrays of numbers on one,
///         doubles as the shortest text that reads back, NaN as null; ends with a line feed.
///         JsonColumns are empty afterwards, as their text stands in this one then.
[[nodiscard]] std::string json_text(Json& value);

/// Takes a piece of a text, which is gone afterwards.
using TakeText = std::function<void(std::string_view)>;

/// The same, piece by piece.
void put_json(Json& value, const TakeText& take);

/// @return the value that reading json_text() of the value back gives, without making the text.
///         JsonColumns, which hold only numbers, words and lists of numbers and words, are empty.
/// @param value  after json_text().
[[nodiscard]] JsonValue json_round_trip(Json value, std::string path);

/// Rows taken apart into columns: of each member its values, null where a row has none. They are
/// kept as the text that they become in the file.
class JsonColumns {
 public:
  /// @param rows  that are to come, for which room is made; 0: not known.
  explicit JsonColumns(std::size_t rows = 0) : expected_(rows) {}

  /// The next cells belong to the next row.
  void begin_row();

  void put_number(std::string_view key, double number);  ///< null where it is not finite
  void put_integer(std::string_view key, int number);
  void put_text(std::string_view key, std::string_view text);
  void put_numbers(std::string_view key, const Eigen::Ref<const Eigen::VectorXd>& numbers);
  void put_value(std::string_view key, const Json& value);

  /// @return an object of arrays, for json_text().
  [[nodiscard]] Json take();

 private:
  struct Column {
    std::string name;
    std::string cells;  // each ends with a line feed, of which JSON on one line has none itself
    std::size_t count = 0;
    bool holds_lists = false;
  };
  std::string& next_cell(std::string_view key, bool is_list);

  std::vector<Column> columns_;
  std::size_t expected_;
  std::size_t rows_ = 0;
  std::size_t at_ = 0;  // where the next member's column probably is: rows are alike
};

[[nodiscard]] Json json_from(const Eigen::Ref<const Eigen::VectorXd>& vector);
[[nodiscard]] Json json_from_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

}  // namespace axiscal
