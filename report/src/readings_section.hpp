// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// The report's section with the readings and the poses of the cube.
/// @param observations  the readings; if null, only the residuals in the record are shown.
[[nodiscard]] std::string cube_section(const Calibration& calibration,
                                       const Observations* observations);

/// The poses of the readings and the direction of the field, for the script that turns the cube.
[[nodiscard]] nlohmann::ordered_json cube_json(const Calibration& calibration);

}  // namespace axiscal
