// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// Reads a positioner file (formats.md, Positioner).
///
/// Each of the six `faces` has a `normal`, or `feet`, or both. If a face has both, the feet are
/// rotated until their contact plane has this normal. `normal_covariance`, `mounts` and `table` are
/// optional. The member `surface` of `table` is "one_piece" (the default) or "separate".
///
/// @param text  the file's content.
/// @param path  the file's name for messages.
/// @throws DataError  if the text is not a valid positioner file, e.g. a face is missing, a normal
///                    does not have unit length, a face does not have three feet, or a key is
///                    unknown. The message begins with the path and the JSON pointer.
[[nodiscard]] AXISCAL_EXPORT Positioner parse_positioner(std::string_view text,
                                                         const std::string& path);

/// Like parse_positioner(), but reads a file. The path `-` means standard input.
[[nodiscard]] AXISCAL_EXPORT Positioner read_positioner(const std::string& path);

/// @return the content of the positioner's file.
[[nodiscard]] AXISCAL_EXPORT std::string positioner_json(const Positioner& positioner);

}  // namespace axiscal
