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

/// Words for the cube's faces in a table of readings, for example "up" or "nose down"; lower case.
using FaceNames = std::map<std::string, Face, std::less<>>;

/// Parses "WORD=FACE,WORD=FACE", for example "up=-Z,nose up=-X". FACE is the face that lies on the
/// table if the column `rest` contains WORD.
/// @throws DomainError  if the text has another form, or if a word occurs twice.
[[nodiscard]] AXISCAL_EXPORT FaceNames parse_face_names(std::string_view text);

/// @return the face for a word in `names` or for a standard name ("+X"); nullopt for other words.
[[nodiscard]] AXISCAL_EXPORT std::optional<Face> find_face(const FaceNames& names,
                                                           std::string_view word);

/// A face that was described in words.
struct FaceInWords {
  Face face;
  std::optional<bool> is_up;  ///< true: "up", false: "down"; nullopt: the words contain neither
};

/// Reads a face in words: "X up", "x_down", "-Z up", "X+", "+x", "xpos", "neg_y", "face Z arriba".
/// @return nullopt for words that do not name a face.
[[nodiscard]] AXISCAL_EXPORT std::optional<FaceInWords> face_in_words(std::string_view words);

}  // namespace axiscal
