// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace axiscal {

/// @return the meaning of a component of the scatter, as a sentence; empty for an unknown
///         component.
[[nodiscard]] std::string_view meaning_of_scatter(std::string_view name);

}  // namespace axiscal
