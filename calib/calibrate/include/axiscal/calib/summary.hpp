// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// A calibration for people: what was done, coefficients with their expanded uncertainties,
/// levelness, quality; plain text of 80 columns, as the command prints it.
[[nodiscard]] std::string summary(const Calibration& calibration);

}  // namespace axiscal
