// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return the text broken at blanks into lines of at most `width` columns, later ones indented.
[[nodiscard]] AXISCAL_EXPORT std::string wrapped(const std::string& text, std::size_t width);

}  // namespace axiscal
