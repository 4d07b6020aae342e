// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// Reads a positioner file (CONTRACT section 6): `id` and the `normal` of each of the six `faces`.
///
/// @param text  the file's content.
/// @param path  the file's name for messages.
/// @throws DataError  if the text is no such file: wrong format or version, a face missing or
///                    misnamed, a normal that is not of unit length, an unknown key.
[[nodiscard]] Positioner parse_positioner(std::string_view text, const std::string& path);

/// As parse_positioner(), from a file; `-` is standard input.
[[nodiscard]] Positioner read_positioner(const std::string& path);

}  // namespace axiscal
