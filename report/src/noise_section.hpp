// SPDX-License-Identifier: Apache-2.0
// The section of a report on the noise of an instrument at rest. It shows the coefficients as data
// sheets state them, and charts of the Allan deviations.
#pragma once

#include <string>

#include "axiscal/logs/noise_json.hpp"
#include "report/src/plot.hpp"

namespace axiscal {

std::string noise_section(const LogNoise& noise, Figures& figures);

}  // namespace axiscal
