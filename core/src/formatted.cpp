// SPDX-License-Identifier: Apache-2.0
#define FMT_HEADER_ONLY
#include "core/formatted.hpp"

#include <fmt/format.h>

namespace axiscal {

std::string formatted_all(fmt::string_view text, fmt::format_args values) {
  return fmt::vformat(text, values);
}

}  // namespace axiscal
