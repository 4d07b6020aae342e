// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/setting.hpp"

/// The settings of a field.
namespace axiscal::settings {

inline constexpr Setting field{"field.kind"};
inline constexpr Setting field_magnitude{"field.magnitude"};
inline constexpr Setting field_magnitude_u{"field.magnitude_u"};
inline constexpr Setting field_table{"field.in_table"};
inline constexpr Setting magnetic_model{"field.model"};
inline constexpr Setting site{"site"};  ///< latitude, longitude and height
inline constexpr Setting longitude{"site.longitude_deg"};
inline constexpr Setting date{"site.date"};
inline constexpr Setting fence_azimuth{"table.fence_azimuth_deg"};
inline constexpr Setting slope{"table.slope"};

}  // namespace axiscal::settings
