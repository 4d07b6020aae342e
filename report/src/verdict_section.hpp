// SPDX-License-Identifier: Apache-2.0
// Whether the calibration holds, in words; of a refused run how its readings probably lay.
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

std::string verdict_section(const Calibration& calibration);

}  // namespace axiscal
