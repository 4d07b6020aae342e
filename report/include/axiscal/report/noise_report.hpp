// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/logs/noise_json.hpp"

namespace axiscal {

/// A page of a log's noise alone: N, B and K as data sheets print them, the Allan deviations in one
/// chart for each unit, how long to dwell. One file that asks for nothing, as calibration_report().
/// @param source  what was recorded, for the title: a file's name.
[[nodiscard]] std::string noise_report(const LogNoise& noise, const std::string& source);

}  // namespace axiscal
