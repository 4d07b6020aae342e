// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// @return the text as UTF-8 if it is UTF-16, with line feeds and plain minus signs and blanks;
///         otherwise unchanged.
[[nodiscard]] ByteSource as_utf8(ByteSource bytes);

/// @return the text as UTF-8: as it is where it is, else each byte is taken as Latin-1 has it.
[[nodiscard]] std::string utf8_of_latin1(std::string_view text);

}  // namespace axiscal
