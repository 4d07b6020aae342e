// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// One warning for all readings that are further from what the others say than chance allows: the
/// worst of them, and how many there are. Those that robust regression gave no weight are passed
/// over.
[[nodiscard]] std::optional<CalibrationWarning> warning_of_outliers(const Calibration& calibration);

}  // namespace axiscal
