// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/face_names.hpp"

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <string>
#include <vector>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the text in lower case, without blanks at its ends.
std::string plain_word(std::string_view text) {
  constexpr std::string_view blanks = " \t";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) {
    return "";
  }
  std::string word(text.substr(first, text.find_last_not_of(blanks) + 1 - first));
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word;
}

}  // namespace

FaceNames parse_face_names(std::string_view text) {
  FaceNames names;
  while (!text.empty()) {
    const std::string_view item = text.substr(0, text.find(','));
    text.remove_prefix(std::min(item.size() + 1, text.size()));
    const std::size_t equals = item.rfind('=');
    const std::string word = plain_word(item.substr(0, equals));
    const std::optional<Face> face = equals == std::string_view::npos
                                         ? std::nullopt
                                         : parse_face(plain_word(item.substr(equals + 1)));
    if (word.empty() || !face) {
      throw DomainError(formatted(
          "'{}' must be WORD=FACE, for example 'up=-Z'; FACE is the face on the table: +X, -X, +Y, "
          "-Y, +Z or -Z",
          item));
    }
    if (!names.emplace(word, *face).second) {
      throw DomainError(formatted("the word '{}' occurs twice", word));
    }
  }
  return names;
}

namespace {

// Returns the words and signs of a text in lower case, for example "+", "x", "up" for "+X_up". A
// sign is a token only if it directly precedes or follows a word. A sign between two letters
// separates two words.
std::vector<std::string> tokens_of(std::string_view text) {
  const std::string word = plain_word(text);
  std::vector<std::string> tokens;
  for (std::size_t i = 0; i < word.size();) {
    const auto is_letter = [&](std::size_t at) {
      const auto c = static_cast<unsigned char>(at < word.size() ? word[at] : ' ');
      return std::isalpha(c) != 0 || c >= 0x80;
    };
    if (is_letter(i)) {
      std::size_t end = i;
      while (is_letter(end)) {
        ++end;
      }
      tokens.push_back(word.substr(i, end - i));
      i = end;
      continue;
    }
    const bool is_sign = word[i] == '+' || word[i] == '-';
    const bool begins = is_letter(i + 1) && (i == 0 || word[i - 1] == ' ');
    const bool ends = i > 0 && is_letter(i - 1) && !is_letter(i + 1);
    if (is_sign && (begins || ends)) {
      tokens.emplace_back(1, word[i]);
    } else if (std::isdigit(static_cast<unsigned char>(word[i])) != 0) {
      tokens.emplace_back("?");
    }
    ++i;
  }
  return tokens;
}

enum class FaceWord { axis, up, down, positive, negative, filler, unknown };

FaceWord word_of(const std::string& token) {
  const auto is_one_of = [&](std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), token) != words.end();
  };
  if (token == "x" || token == "y" || token == "z") {
    return FaceWord::axis;
  }
  if (is_one_of(
          {"up", "upward", "upwards", "top", "sky", "arriba", "oben", "haut", "su", "alto"})) {
    return FaceWord::up;
  }
  if (is_one_of({"down", "downward", "downwards", "dn", "bottom", "ground", "abajo", "unten", "bas",
                 "giu", "basso"})) {
    return FaceWord::down;
  }
  if (is_one_of({"+", "p", "pos", "positive", "plus", "positivo", "positiv"})) {
    return FaceWord::positive;
  }
  if (is_one_of({"-", "n", "m", "neg", "negative", "minus", "negativo", "negativ"})) {
    return FaceWord::negative;
  }
  if (is_one_of({"axis", "face", "side", "eje", "cara", "achse", "seite", "axe", "is", "facing",
                 "hacia", "acc", "accel", "g"})) {
    return FaceWord::filler;
  }
  return FaceWord::unknown;
}

// Splits the letter of an axis from either end of a word: "xup" into "x" and "up".
std::vector<std::string> split_axis(const std::string& token) {
  if (word_of(token) != FaceWord::unknown || token.size() < 2) {
    return {token};
  }
  for (const bool first : {true, false}) {
    const std::string letter(1, first ? token.front() : token.back());
    const std::string rest = first ? token.substr(1) : token.substr(0, token.size() - 1);
    if (word_of(letter) == FaceWord::axis && word_of(rest) != FaceWord::unknown) {
      return {letter, rest};
    }
  }
  return {token};
}

}  // namespace

std::optional<FaceInWords> face_in_words(std::string_view words) {
  std::optional<int> axis;
  std::optional<bool> is_negative;
  std::optional<bool> is_up;
  for (const std::string& token : tokens_of(words)) {
    for (const std::string& part : split_axis(token)) {
      switch (word_of(part)) {
        case FaceWord::axis:
          if (axis) {
            return std::nullopt;
          }
          axis = part.front() - 'x';
          break;
        case FaceWord::up:
        case FaceWord::down:
          if (is_up) {
            return std::nullopt;
          }
          is_up = word_of(part) == FaceWord::up;
          break;
        case FaceWord::positive:
        case FaceWord::negative:
          if (is_negative) {
            return std::nullopt;
          }
          is_negative = word_of(part) == FaceWord::negative;
          break;
        case FaceWord::filler:
          break;
        case FaceWord::unknown:
          return std::nullopt;
      }
    }
  }
  if (!axis || (!is_negative && !is_up)) {
    return std::nullopt;
  }
  return FaceInWords{.face = face_of(*axis, !is_negative.value_or(false)), .is_up = is_up};
}

std::optional<Face> find_face(const FaceNames& names, std::string_view word) {
  const auto found = names.find(plain_word(word));
  return found != names.end() ? std::optional(found->second) : parse_face(word);
}

}  // namespace axiscal
