// SPDX-License-Identifier: Apache-2.0
// The noise of an instrument at rest: a table as data sheets print it, and its Allan deviations.
#pragma once

#include <string>

#include "axiscal/logs/noise_json.hpp"
#include "report/src/plot.hpp"

namespace axiscal {

std::string noise_section(const LogNoise& noise, Figures& figures);

}  // namespace axiscal
