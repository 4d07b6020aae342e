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

#include "core/json_writer.hpp"

namespace axiscal {

/// A value in a JSON file together with its place, so that every error message states the place.
///
/// All accessors throw DataError `PATH: /json/pointer: ...` if the value has the wrong type or
/// size.
class JsonValue {
 public:
  /// Makes the root value of a file.
  JsonValue(Json document, std::string path);

  [[nodiscard]] JsonValue at(std::string_view key) const;  ///< a required member
  [[nodiscard]] std::optional<JsonValue> find(
      std::string_view key) const;                        ///< nullopt if the key is absent or null
  [[nodiscard]] std::vector<JsonValue> elements() const;  ///< the elements of an array
  /// Calls `take` for each row of a table. A table is an array of objects, or an object of arrays
  /// of equal length (see JsonColumns). In the second form, row i is an object that consists of the
  /// i-th element of each array.
  void for_each_row(const std::function<void(const JsonValue&)>& take) const;
  [[nodiscard]] double number() const;
  [[nodiscard]] double number_or_nan() const;  ///< NaN if the value is null
  [[nodiscard]] int integer() const;
  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] bool boolean() const;
  [[nodiscard]] std::string text() const;
  [[nodiscard]] bool is_array() const { return value_->is_array(); }
  /// @return true for an object, and for a row of a table.
  [[nodiscard]] bool is_object() const { return value_->is_object(); }
  [[nodiscard]] bool is_text() const { return value_->is_string(); }
  /// @return the numbers of an array; all must be finite.
  [[nodiscard]] Eigen::VectorXd vector(std::optional<Eigen::Index> size = {}) const;
  [[nodiscard]] Eigen::VectorXd vector_or_nan(std::optional<Eigen::Index> size = {}) const;
  /// @return the numbers of an array of rows; all must be finite.
  [[nodiscard]] Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index columns) const;
  [[nodiscard]] Eigen::MatrixXd matrix_or_nan(Eigen::Index rows, Eigen::Index columns) const;
  [[nodiscard]] std::vector<std::string> texts() const;
  /// @return the names of an object's members, in the file's order.
  [[nodiscard]] std::vector<std::string> keys() const;

  /// @return a member's text; `otherwise` if the member is absent.
  [[nodiscard]] std::string text_or(std::string_view key, const std::string& otherwise = "") const;

  /// Throws if a member's name is not in `keys`. The message suggests the nearest name.
  void allow_keys(std::span<const std::string_view> keys) const;

  /// Checks `format`, and that `version` is 1 to `last_version`.
  void require_format(std::string_view format, int last_version = 1) const;

  /// Calls check_value() and converts a DomainError to a DataError that states this value's place.
  void check(const std::function<void()>& check_value) const;

  /// @return the value as JSON text, for example to parse it as a separate file.
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
  std::optional<std::size_t> row_;  // row number, if the value is a row of a table
};

/// @return the parsed text. If the text is not JSON or is nested more than 1,000 levels deep, the
///         result is a value for which is_discarded() is true.
[[nodiscard]] Json json_or_discarded(std::string_view text);

/// @throws DataError  `PATH:LINE: ...` if the text is not JSON, or is nested too deep.
[[nodiscard]] JsonValue parse_json(std::string_view text, std::string path);

}  // namespace axiscal
