// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// @return the bytes of a text. UTF-16 is converted to UTF-8, and other encodings are kept. In text
///         that is not UTF-16, carriage returns become line feeds if each line ends with a carriage
///         return alone, and typographic blanks and minus signs become ASCII characters.
[[nodiscard]] ByteSource as_utf8(ByteSource bytes);

/// @return the text unchanged if it is UTF-8; otherwise it is converted from Latin-1.
[[nodiscard]] std::string utf8_of_latin1(std::string_view text);

}  // namespace axiscal
