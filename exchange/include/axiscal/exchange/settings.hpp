// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/setting.hpp"

/// The settings of an export or import.
namespace axiscal::settings {

inline constexpr Setting imported_magnitude{"import.magnitude"};
inline constexpr Setting local_gravity{"export.local_gravity"};
inline constexpr Setting lossy{"export.lossy"};
inline constexpr Setting numbers{"export.numbers"};
inline constexpr Setting reading_factor{"export.reading_factor"};

}  // namespace axiscal::settings
