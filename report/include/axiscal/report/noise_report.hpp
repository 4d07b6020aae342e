// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/logs/noise_json.hpp"

namespace axiscal {

/// A report of a log's noise as one HTML page: N, B and K in the form of data sheets, a chart of
/// the Allan deviations for each unit, and dwell times. The page does not load other files.
/// @param source  the file name of the log, for the title.
[[nodiscard]] std::string noise_report(const LogNoise& noise, const std::string& source);

}  // namespace axiscal
