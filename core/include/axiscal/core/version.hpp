// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace axiscal {

/// @return name and version of this library as records state it, e.g. "axiscal 0.1.0".
[[nodiscard]] std::string_view software_name();

}  // namespace axiscal
