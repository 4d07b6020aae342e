// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// The names of the cube's faces in a table of readings: "up", "nose down", ...; in small letters.
using FaceNames = std::map<std::string, Face, std::less<>>;

/// Reads "WORD=FACE,WORD=FACE", as "up=-Z,nose up=-X": the face that lies on the table where the
/// column `rest` has the word.
/// @throws DomainError  for a text of another form, or a word that occurs twice.
[[nodiscard]] AXISCAL_EXPORT FaceNames parse_face_names(std::string_view text);

/// @return the face of a word, or of a face's standard name; nullopt for other words.
[[nodiscard]] AXISCAL_EXPORT std::optional<Face> find_face(const FaceNames& names,
                                                           std::string_view word);

/// A face as people call it.
struct FaceInWords {
  Face face;
  std::optional<bool> is_up;  ///< the direction in the words: up or down; nullopt: neither
};

/// Reads a face in words: "X up", "x_down", "-Z up", "X+", "+x", "xpos", "neg_y", "face Z arriba".
/// @return nullopt for words that do not name a face.
[[nodiscard]] AXISCAL_EXPORT std::optional<FaceInWords> face_in_words(std::string_view words);

}  // namespace axiscal
