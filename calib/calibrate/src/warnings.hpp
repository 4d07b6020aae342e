// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/culprit.hpp"
#include "axiscal/calib/estimation.hpp"

namespace axiscal {

/// What in a fit asks for the user's attention, the gravest first. Empty for a good run.
///
/// Codes and thresholds are listed in docs/messages.md.
/// @param searched  whether the culprit search looked at the readings.
/// @param culprit   what it found.
[[nodiscard]] std::vector<CalibrationWarning> find_warnings(const Calibration& calibration,
                                                            const Estimate& estimate,
                                                            std::vector<int> unpaired_runs,
                                                            bool searched,
                                                            const std::optional<Culprit>& culprit);

}  // namespace axiscal
