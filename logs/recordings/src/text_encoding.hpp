// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// @return UTF-16 text as UTF-8; other text with line feeds, plain minus signs and blanks.
[[nodiscard]] ByteSource as_utf8(ByteSource bytes);

/// @return the text as UTF-8: as it is where it is, else each byte is taken as Latin-1 has it.
[[nodiscard]] std::string utf8_of_latin1(std::string_view text);

}  // namespace axiscal
