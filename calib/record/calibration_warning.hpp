// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// Adds a warning to a finished calibration. A status "ok" becomes "warning".
void add_warning(Calibration& calibration, CalibrationWarning warning);

/// @return the run numbers in words, for example "run 7", "runs 3 and 8" or "runs 1, 4 and 9".
[[nodiscard]] std::string name_of_runs(const std::vector<int>& runs);

}  // namespace axiscal
