// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @param indent  number of blanks at the start of each line except the first. `width` includes
///                them.
/// @return the text broken at blanks into lines of at most `width` columns.
[[nodiscard]] AXISCAL_EXPORT std::string wrapped(const std::string& text,
                                                 std::size_t width,
                                                 std::size_t indent = 4);

}  // namespace axiscal
