// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// Returns the section of a report with the readings and the poses of the cube.
/// @param observations  observations of the calibration; if null, the section shows only the
///                      residuals in the record.
[[nodiscard]] std::string cube_section(const Calibration& calibration,
                                       const Observations* observations);

/// Returns the poses of the readings and the direction of the field, for the script that draws the
/// cube.
[[nodiscard]] nlohmann::ordered_json cube_json(const Calibration& calibration);

}  // namespace axiscal
