// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/face_names.hpp"

#include <algorithm>
#include <cctype>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"

namespace axiscal {
namespace {

// Without blanks at its ends, in small letters.
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
          "'{}' is not WORD=FACE, as 'up=-Z': the face that lies on the table (+X -X +Y -Y +Z -Z)",
          item));
    }
    if (!names.emplace(word, *face).second) {
      throw DomainError(formatted("the word '{}' is there twice", word));
    }
  }
  return names;
}

std::optional<Face> find_face(const FaceNames& names, std::string_view word) {
  const auto found = names.find(plain_word(word));
  return found != names.end() ? std::optional(found->second) : parse_face(word);
}

}  // namespace axiscal
