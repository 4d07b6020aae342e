// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "culprit.hpp"
#include "estimation.hpp"

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

/// Adds a warning to a finished calibration, whose status is then no longer "ok".
void add_warning(Calibration& calibration, CalibrationWarning warning);

/// @return "run 7", "runs 3 and 8", "runs 1, 4 and 9".
[[nodiscard]] std::string name_of_runs(const std::vector<int>& runs);

}  // namespace axiscal
