// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// The readings and the cube's seats, as the report shows them.
/// @param observations  what was read; null: only what the record holds.
[[nodiscard]] std::string cube_section(const Calibration& calibration,
                                       const Observations* observations);

/// As above, for the drawing in three dimensions.
[[nodiscard]] nlohmann::ordered_json cube_json(const Calibration& calibration);

}  // namespace axiscal
