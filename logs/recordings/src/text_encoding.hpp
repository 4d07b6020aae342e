// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// @return UTF-16 text as UTF-8; other text stays in its encoding. There, carriage returns become
///         line feeds if the lines end with carriage returns only, and typographic blanks and minus
///         signs become ASCII characters.
[[nodiscard]] ByteSource as_utf8(ByteSource bytes);

/// @return the text unchanged if it is UTF-8; otherwise it is converted from Latin-1.
[[nodiscard]] std::string utf8_of_latin1(std::string_view text);

}  // namespace axiscal
