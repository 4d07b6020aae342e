// SPDX-License-Identifier: Apache-2.0
// The report's section on the verdict. For a refused run, it shows the probable poses or values of
// wrong readings.
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

std::string verdict_section(const Calibration& calibration);

}  // namespace axiscal
