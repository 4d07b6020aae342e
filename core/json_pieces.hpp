// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Finds members of a JSON object in its text, ten times as fast as the parser. The text between
/// the members is not checked.
///
/// @param members  the members' JSON pointers: "/created", "/statistics/covariance".
/// @param pieces   receives the text of each member's value; entries of missing members do not
///                 change.
/// @return false if the text is not an object, ends early, repeats a wanted member or one of its
///         parents, contains a name with an escape or a slash, or if a parent is not an object. The
///         caller then runs the parser, which reports any error.
[[nodiscard]] bool find_json_pieces(std::string_view text,
                                    std::span<const std::string_view> members,
                                    std::span<std::string_view> pieces);

/// Finds members of a JSON object like find_json_pieces().
/// @return the text of each member's value, empty for a missing member; nullopt if
///         find_json_pieces() returns false.
template <std::size_t N>
[[nodiscard]] std::optional<std::array<std::string_view, N>> json_pieces(
    std::string_view text, const std::array<std::string_view, N>& members) {
  std::array<std::string_view, N> pieces;
  return find_json_pieces(text, members, pieces) ? std::optional(pieces) : std::nullopt;
}

/// @return the elements of an array; `nullopt` if `piece` is not an array.
[[nodiscard]] std::optional<std::vector<std::string_view>> list_of_piece(std::string_view piece);

/// @return the matrix; `nullopt` if the array has another size, or an entry is neither a finite
///         number nor null. null becomes NaN.
[[nodiscard]] std::optional<Eigen::MatrixXd> matrix_of_piece(std::string_view piece,
                                                             Eigen::Index rows,
                                                             Eigen::Index columns);

/// @return the numbers of an array, NaN for null; `nullopt` if the array has another size, or an
///         entry is neither a finite number nor null.
[[nodiscard]] std::optional<Eigen::VectorXd> vector_of_piece(std::string_view piece,
                                                             Eigen::Index size);

/// @return the texts of an array; `nullopt` if an element is not a text, or a text is not plain
///         ASCII.
[[nodiscard]] std::optional<std::vector<std::string>> texts_of_piece(std::string_view piece);

/// @return the text; `nullopt` if `piece` is not a text of plain ASCII.
[[nodiscard]] std::optional<std::string> text_of_piece(std::string_view piece);

/// Iterates over the entries of a list or the members of an object. It stores no entries and does
/// not parse their content.
class JsonEntries {
 public:
  /// @param text  a text that begins with the list or object.
  explicit JsonEntries(std::string_view text);

  [[nodiscard]] bool is_list() const { return open_ == '['; }
  [[nodiscard]] bool is_object() const { return open_ == '{'; }

  /// Moves to the next entry.
  /// @return false at the end, or if the text is not JSON. Only in the second case is ok() false.
  bool next();

  [[nodiscard]] std::string_view value() const { return value_; }
  /// @return a member's name without its quotes. Escapes in it are not decoded.
  [[nodiscard]] std::string_view key() const { return key_; }
  [[nodiscard]] bool ok() const { return ok_; }
  /// @return the text after the entries that were read.
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  bool end(bool ok);

  std::string_view rest_, key_, value_;
  char open_ = '\0';
  bool is_first_ = true;
  bool ok_ = true;
};

/// @return the greatest nesting depth of arrays and objects, up to the first syntax error.
[[nodiscard]] std::size_t depth_of_json(std::string_view text);

}  // namespace axiscal
