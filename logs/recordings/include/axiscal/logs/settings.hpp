// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/setting.hpp"

/// What a log is asked for.
namespace axiscal::settings {

inline constexpr Setting log{"log"};                   ///< a raw log instead of observations
inline constexpr Setting column_names{"log.columns"};  ///< what its columns are called
/// The most that a file may cost.
inline constexpr Setting read_limit{"log.limits"};
inline constexpr Setting time_column{"log.time"};
inline constexpr Setting rate{"log.rate_hz"};
inline constexpr Setting shortest_rest{"segment.shortest_s"};

}  // namespace axiscal::settings
