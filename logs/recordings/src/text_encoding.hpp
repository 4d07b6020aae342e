// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// @return the same text as UTF-8, where it is UTF-16, with line feeds and plain minus signs and
///         blanks; else as it is.
[[nodiscard]] ByteSource as_utf8(ByteSource bytes);

/// @return the text as UTF-8: as it is where it is, else each byte is taken as Latin-1 has it.
[[nodiscard]] std::string utf8_of_latin1(std::string_view text);

}  // namespace axiscal
