// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/setting.hpp"

/// Names of the settings for reading a log. Error messages state which setting solves the problem.
namespace axiscal::settings {

inline constexpr Setting log{"log"};                   ///< raw log, read instead of observations
inline constexpr Setting column_names{"log.columns"};  ///< names of the log's columns
/// Limits on the cost of reading a file.
inline constexpr Setting read_limit{"log.limits"};
inline constexpr Setting time_column{"log.time"};
inline constexpr Setting rate{"log.rate_hz"};
inline constexpr Setting shortest_rest{"segment.shortest_s"};

}  // namespace axiscal::settings
