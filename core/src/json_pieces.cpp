// SPDX-License-Identifier: Apache-2.0
#include "core/json_pieces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "axiscal/core/not_a_number.hpp"
#include "core/read_double.hpp"

namespace axiscal {
namespace {

// Returns a table that is indexed by character codes. The entries of the characters in `some` are
// true.
constexpr std::array<bool, 256> those(std::string_view some) {
  std::array<bool, 256> all{};
  for (const char c : some) {
    all[static_cast<unsigned char>(c)] = true;
  }
  return all;
}

constexpr std::array<bool, 256> space = those(" \t\r\n");

// A position in a JSON text. Each function that reads a token moves the position to the token's
// end, and returns false if the text ends too early.
class JsonSkimmer {
 public:
  explicit JsonSkimmer(std::string_view text) : text_(text) {}

  [[nodiscard]] char at() const { return place_ < text_.size() ? text_[place_] : '\0'; }
  [[nodiscard]] bool at_end() const { return place_ == text_.size(); }
  [[nodiscard]] std::size_t place() const { return place_; }
  [[nodiscard]] std::string_view since(std::size_t place) const {
    return text_.substr(place, place_ - place);
  }

  void skip_space() {
    while (place_ < text_.size() && space[static_cast<unsigned char>(text_[place_])]) {
      ++place_;
    }
  }

  // Skips the character `c` and the space around it.
  bool take(char c) {
    skip_space();
    if (at() != c) {
      return false;
    }
    ++place_;
    skip_space();
    return true;
  }

  // Moves from the opening quote to just past the closing quote.
  bool skip_string() {
    std::size_t begin = place_ + 1;
    std::size_t end = text_.find('"', begin);
    while (end != text_.npos) {
      const std::size_t escape = text_.substr(0, end).find('\\', begin);
      if (escape == text_.npos) {
        place_ = end + 1;
        return true;
      }
      begin = escape + 2;
      if (begin > end) {  // the quote at `end` is escaped
        end = text_.find('"', begin);
      }
    }
    place_ = text_.size();
    return false;
  }

  bool skip_value() {
    static constexpr std::array<bool, 256> marks = those("\"{}[]");
    static constexpr std::array<bool, 256> marks_or_comma = those("\"{}[],");
    std::size_t depth = 0;
    do {
      const std::array<bool, 256>& ends = depth > 0 ? marks : marks_or_comma;
      const std::string_view rest = text_.substr(place_);
      place_ += static_cast<std::size_t>(
          std::find_if(rest.begin(), rest.end(),
                       [&](char c) { return ends[static_cast<unsigned char>(c)]; }) -
          rest.begin());
      switch (at()) {
        case '"':
          if (!skip_string()) {
            return false;
          }
          break;
        case '{':
        case '[':
          ++depth;
          deepest_ = std::max(deepest_, depth);
          ++place_;
          break;
        case '}':
        case ']':
          if (depth == 0) {
            return true;  // the bracket of the container ends the number or word
          }
          --depth;
          ++place_;
          break;
        default:
          return depth == 0 && at() == ',';
      }
    } while (depth > 0);
    return true;
  }

  std::optional<std::string_view> take_value() {
    const std::size_t begin = place_;
    if (!skip_value()) {
      return std::nullopt;
    }
    const std::string_view value = since(begin);
    return value.substr(0, value.find_last_not_of(" \t\r\n") + 1);
  }

  // The greatest nesting depth in the values that were skipped.
  [[nodiscard]] std::size_t deepest() const { return deepest_; }

  // Reads a JSON number. Reads null as NaN.
  bool take_number(double& number) {
    const std::string_view rest = text_.substr(place_);
    if (rest.starts_with("null")) {
      number = not_a_number;
      place_ += 4;
      return true;
    }
    const std::size_t sign = rest.starts_with('-') ? 1 : 0;
    if (rest.size() <= sign || rest[sign] < '0' || rest[sign] > '9') {
      return false;
    }
    const auto [end, error] = read_double(rest.data(), rest.data() + rest.size(), number);
    const auto size = static_cast<std::size_t>(end - rest.data());
    place_ += size;
    const auto is_digit = [&](std::size_t i) {
      return i < size && rest[i] >= '0' && rest[i] <= '9';
    };
    const std::size_t point = rest.substr(0, size).find('.');
    if (rest.substr(0, size) == "-0") {
      number = 0.0;  // as the JSON parser does: it reads -0 as the integer 0
    }
    return error == std::errc() && std::isfinite(number) &&
           !(rest[sign] == '0' && is_digit(sign + 1)) &&
           (point == rest.npos || is_digit(point + 1));
  }

  bool take_text(std::string& text) {
    const std::size_t begin = place_ + 1;
    if (at() != '"' || !skip_string()) {
      return false;
    }
    text = text_.substr(begin, place_ - begin - 1);
    return std::all_of(text.begin(), text.end(),
                       [](char c) { return c >= ' ' && c <= '~' && c != '\\'; });
  }

  // Reads a list. Calls `take_entry` with the zero-based index of each entry, to read the entry.
  template <typename TakeEntry>
  bool take_list(const TakeEntry& take_entry) {
    if (!take('[')) {
      return false;
    }
    if (take(']')) {
      return true;
    }
    for (Eigen::Index i = 0;; ++i) {
      if (!take_entry(i)) {
        return false;
      }
      if (!take(',')) {
        return take(']');
      }
    }
  }

 private:
  std::string_view text_;
  std::size_t place_ = 0;
  std::size_t deepest_ = 0;
};

}  // namespace

JsonEntries::JsonEntries(std::string_view text) : rest_(text) {
  rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
  open_ = rest_.empty() ? '\0' : rest_.front();
  ok_ = is_list() || is_object();
}

bool JsonEntries::end(bool ok) {
  ok_ = ok;
  open_ = '\0';
  return false;
}

bool JsonEntries::next() {
  if (open_ == '\0') {
    return false;
  }
  JsonSkimmer at(rest_);
  const char close = is_list() ? ']' : '}';
  const bool may_end = at.take(is_first_ ? open_ : ',');
  if (!may_end || is_first_) {
    const bool ends = at.take(close);
    if (ends || !may_end) {
      rest_.remove_prefix(at.place());
      return end(ends);
    }
  }
  is_first_ = false;
  if (is_object()) {
    const std::size_t begin = at.place();
    if (at.at() != '"' || !at.skip_string()) {
      return end(false);
    }
    key_ = at.since(begin).substr(1, at.place() - begin - 2);
    if (!at.take(':')) {
      return end(false);
    }
  }
  const std::optional<std::string_view> value = at.take_value();
  if (!value || value->empty()) {
    return end(false);
  }
  value_ = *value;
  rest_.remove_prefix(at.place());
  return true;
}

namespace {

class PieceFinder {
 public:
  PieceFinder(std::string_view text,
              std::span<const std::string_view> members,
              std::span<std::string_view> pieces)
      : at_(text), members_(members), pieces_(pieces) {}

  [[nodiscard]] bool find() { return take_object("") && at_.at_end(); }

 private:
  // NOLINTNEXTLINE(misc-no-recursion): not deeper than the pointers in members_
  bool take_object(std::string_view pointer) {
    if (!at_.take('{')) {
      return false;
    }
    if (at_.take('}')) {
      return true;
    }
    do {
      const std::size_t begin = at_.place();
      if (at_.at() != '"' || !at_.skip_string()) {
        return false;
      }
      const std::string_view name = at_.since(begin).substr(1, at_.place() - begin - 2);
      // A name with an escape or a slash cannot be compared with the members' JSON pointers.
      const bool is_plain = name.find_first_of("\\/") == name.npos;
      if (!is_plain || !at_.take(':') || !take_member(pointer, name)) {
        return false;
      }
    } while (at_.take(','));
    return at_.take('}');
  }

  // NOLINTNEXTLINE(misc-no-recursion): as take_object()
  bool take_member(std::string_view of, std::string_view name) {
    std::string_view* piece = nullptr;
    for (std::size_t i = 0; i < members_.size(); ++i) {
      const std::string_view member = members_[i];
      const std::size_t size = of.size() + 1 + name.size();
      if (member.size() < size || member.substr(of.size() + 1, name.size()) != name ||
          !member.starts_with(of)) {
        continue;
      }
      if (member.size() == size) {
        piece = &pieces_[i];
      } else if (member[size] == '/') {
        const std::string_view object = member.substr(0, size);
        const bool twice = std::find(objects_.begin(), objects_.end(), object) != objects_.end();
        objects_.push_back(object);
        return !twice && take_object(object);
      }
    }
    if (piece == nullptr) {
      return at_.skip_value();
    }
    const bool twice = !piece->empty();
    *piece = at_.take_value().value_or("");
    return !twice && !piece->empty();
  }

  JsonSkimmer at_;
  std::span<const std::string_view> members_;
  std::span<std::string_view> pieces_;
  std::vector<std::string_view> objects_;  // parents of members that were found
};

}  // namespace

bool find_json_pieces(std::string_view text,
                      std::span<const std::string_view> members,
                      std::span<std::string_view> pieces) {
  return PieceFinder(text, members, pieces).find();
}

std::optional<std::vector<std::string_view>> list_of_piece(std::string_view piece) {
  JsonSkimmer at(piece);
  std::vector<std::string_view> pieces;
  const bool whole = at.take_list([&](Eigen::Index) {
    const std::optional<std::string_view> one = at.take_value();
    pieces.push_back(one.value_or(""));
    return one.has_value();
  });
  return whole && at.at_end() ? std::optional(std::move(pieces)) : std::nullopt;
}

std::optional<Eigen::MatrixXd> matrix_of_piece(std::string_view piece,
                                               Eigen::Index rows,
                                               Eigen::Index columns) {
  // Each number takes at least two characters of the text. If the text is too short for this size
  // of the matrix, the text is rejected before memory is allocated.
  const auto most = static_cast<Eigen::Index>(piece.size() / 2);
  if (rows > most || columns > most || rows * columns > most) {
    return std::nullopt;
  }
  JsonSkimmer at(piece);
  Eigen::MatrixXd matrix(rows, columns);
  Eigen::Index count = 0;
  const bool whole = at.take_list([&](Eigen::Index i) {
    Eigen::Index in_row = 0;
    const bool row = at.take_list([&](Eigen::Index j) {
      ++in_row;
      return i < rows && j < columns && at.take_number(matrix(i, j));
    });
    ++count;
    return row && in_row == columns;
  });
  return whole && count == rows && at.at_end() ? std::optional(std::move(matrix)) : std::nullopt;
}

std::optional<Eigen::VectorXd> vector_of_piece(std::string_view piece, Eigen::Index size) {
  if (size > static_cast<Eigen::Index>(piece.size() / 2)) {
    return std::nullopt;
  }
  JsonSkimmer at(piece);
  Eigen::VectorXd vector(size);
  Eigen::Index count = 0;
  const bool whole =
      at.take_list([&](Eigen::Index i) { return ++count <= size && at.take_number(vector(i)); });
  return whole && count == size && at.at_end() ? std::optional(std::move(vector)) : std::nullopt;
}

std::optional<std::vector<std::string>> texts_of_piece(std::string_view piece) {
  JsonSkimmer at(piece);
  std::vector<std::string> texts;
  const bool whole = at.take_list([&](Eigen::Index) { return at.take_text(texts.emplace_back()); });
  return whole && at.at_end() ? std::optional(std::move(texts)) : std::nullopt;
}

std::optional<std::string> text_of_piece(std::string_view piece) {
  JsonSkimmer at(piece);
  std::string text;
  return at.take_text(text) && at.at_end() ? std::optional(std::move(text)) : std::nullopt;
}

std::size_t depth_of_json(std::string_view text) {
  JsonSkimmer at(text);
  at.skip_value();
  return at.deepest();
}

}  // namespace axiscal
