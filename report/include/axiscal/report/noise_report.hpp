// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/logs/noise_json.hpp"

namespace axiscal {

/// Writes a report of the noise of a log as one HTML page. It shows the coefficients N (white
/// noise), B (bias instability) and K (random walk) as data sheets state them, a chart of the Allan
/// deviations for each unit, and dwell times. The page does not load other files.
/// @param source  file name of the log, for the title.
[[nodiscard]] std::string noise_report(const LogNoise& noise, const std::string& source);

}  // namespace axiscal
