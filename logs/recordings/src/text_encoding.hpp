// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// @return UTF-16 text as UTF-8. In other text, carriage returns at the ends of lines, typographic
///         blanks and minus signs are replaced by plain ones.
[[nodiscard]] ByteSource as_utf8(ByteSource bytes);

/// @return the text unchanged if it is UTF-8; otherwise it is converted from Latin-1.
[[nodiscard]] std::string utf8_of_latin1(std::string_view text);

}  // namespace axiscal
