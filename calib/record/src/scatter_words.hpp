// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace axiscal {

/// @return what a component of the scatter means, in a sentence; empty for one that is not known.
[[nodiscard]] std::string_view meaning_of_scatter(std::string_view name);

}  // namespace axiscal
