// SPDX-License-Identifier: Apache-2.0
#pragma once

#if __cplusplus < 202002L && (!defined(_MSVC_LANG) || _MSVC_LANG < 202002L)
#error "Axiscal needs C++20: compile with -std=c++20, or target_compile_features(... cxx_std_20)"
#endif

#include <string_view>

#include "axiscal/core/export.hpp"

// The version of the headers, for the preprocessor. AXISCAL_VERSION >= 100 means 0.1.0 or later.
#define AXISCAL_VERSION_MAJOR 0
#define AXISCAL_VERSION_MINOR 1
#define AXISCAL_VERSION_PATCH 0
#define AXISCAL_VERSION \
  (AXISCAL_VERSION_MAJOR * 10000 + AXISCAL_VERSION_MINOR * 100 + AXISCAL_VERSION_PATCH)

namespace axiscal {

/// @return name and version of this library as records contain it, e.g. "axiscal 0.1.0".
[[nodiscard]] AXISCAL_EXPORT std::string_view software_name();

}  // namespace axiscal
