// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "axiscal/core/json_layout.hpp"

namespace axiscal {

using Json = nlohmann::ordered_json;

/// Receives a piece of a text. The piece is valid only during the call.
using TakeText = std::function<void(std::string_view)>;

/// Writes JSON text value by value, without a tree in memory. In an object, each value follows a
/// call of key().
///
/// A list of numbers or texts is on one line. A double has the shortest text that reads back to it;
/// a double that is not finite is null.
class JsonWriter {
 public:
  /// @param take  if it is not empty, it receives the text in pieces of about 64 KiB.
  explicit JsonWriter(JsonLayout layout = JsonLayout::lines, TakeText take = {})
      : layout_(layout), take_(std::move(take)) {}

  [[nodiscard]] JsonLayout layout() const { return layout_; }

  void begin_object() { begin('{'); }
  void end_object() { end('}'); }
  /// Begins a list whose entries are on separate lines.
  void begin_list() { begin('['); }
  void end_list() { end(']'); }
  void key(std::string_view name);

  void number(double number);
  void integer(std::int64_t number);
  void flag(bool flag);
  void text(std::string_view text);
  void value(const Json& value);
  void numbers(const Eigen::Ref<const Eigen::VectorXd>& numbers);
  void integers(const std::vector<int>& numbers);
  void texts(const std::vector<std::string>& texts);
  /// Writes a list of rows, each a list of numbers.
  void matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
  /// Writes a list whose entries are given as JSON text. A line feed ends each entry.
  /// @param of_lists  true if the entries are lists; each entry is then on its own line.
  void column(std::string_view entries, bool of_lists);

  /// Remembers a reason why a reader would refuse the JSON text. Only the first reason is kept.
  void add_problem(std::string_view key, std::string_view problem);
  /// @return the remembered key and reason, "KEY REASON"; empty if there is none.
  [[nodiscard]] const std::string& problem() const { return problem_; }

  /// @return the text that was not passed to `take`.
  [[nodiscard]] std::string finish();

 private:
  struct Level {
    bool is_list = false;
    bool is_empty = true;
  };
  void begin(char bracket);
  void end(char bracket);
  void begin_entry();
  void begin_value();
  void new_line();
  [[nodiscard]] std::string_view comma() const { return layout_ == JsonLayout::lines ? ", " : ","; }

  JsonLayout layout_;
  TakeText take_;
  std::string text_;
  std::vector<Level> levels_;
  std::string problem_;
};

/// @return the value as text, in the layout JsonLayout::lines.
[[nodiscard]] std::string json_text(const Json& value);

/// A table that is stored by columns. The column of a member contains its value in each row, or
/// null if a row lacks the member. The values are stored as JSON text, as it will be in the file.
class JsonColumns {
 public:
  /// @param rows  the expected number of rows, for which memory is reserved; 0: unknown.
  explicit JsonColumns(std::size_t rows = 0, JsonLayout layout = JsonLayout::lines)
      : expected_(rows), layout_(layout) {}

  /// Starts the next row.
  void begin_row();

  void put_number(std::string_view key, double number);  ///< writes null if it is not finite
  void put_integer(std::string_view key, int number);
  void put_text(std::string_view key, std::string_view text);
  void put_numbers(std::string_view key, const Eigen::Ref<const Eigen::VectorXd>& numbers);
  void put_value(std::string_view key, const Json& value);

  /// Writes an object of arrays. The memory of each column is freed after the column is written.
  void write_to(JsonWriter& writer);

 private:
  struct Column {
    std::string name;
    // The JSON texts of all cells, each followed by a line feed. The JSON of a cell contains no
    // line feed.
    std::string cells;
    std::size_t count = 0;
    bool holds_lists = false;
  };
  std::string& next_cell(std::string_view key, bool is_list);

  std::vector<Column> columns_;
  std::size_t expected_;
  JsonLayout layout_;
  std::size_t rows_ = 0;
  // Index of the column in which the next member is expected. Usually all rows have the same order.
  std::size_t at_ = 0;
};

[[nodiscard]] Json json_from(const Eigen::Ref<const Eigen::VectorXd>& vector);
[[nodiscard]] Json json_from_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

}  // namespace axiscal
