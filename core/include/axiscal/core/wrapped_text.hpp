// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @param indent  blanks before the second line and later ones; they count as columns.
/// @return the text broken at blanks into lines of at most `width` columns.
[[nodiscard]] AXISCAL_EXPORT std::string wrapped(const std::string& text,
                                                 std::size_t width,
                                                 std::size_t indent = 4);

}  // namespace axiscal
