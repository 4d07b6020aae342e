// SPDX-License-Identifier: Apache-2.0
// The section of a report on the verdict. For a refused run, it shows the probable pose or value of
// each wrong reading.
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

std::string verdict_section(const Calibration& calibration);

}  // namespace axiscal
