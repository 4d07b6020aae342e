// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/design_quality.hpp"
#include "axiscal/calib/forecast.hpp"
#include "axiscal/calib/tolerance.hpp"

namespace axiscal::cli {

/// The results of `axiscal plan`.
struct Plan {
  ForecastSetup setup;
  DesignQuality quality;
  std::optional<OptimalDesign> optimal;
  std::optional<Forecast> forecast;
  std::optional<double> wanted_rad;
  int replicates_needed = 0;
  std::vector<ToleranceEffect> tolerances;
  std::vector<std::string> remarks;
};

/// @return the plan as a text of at most 80 columns.
[[nodiscard]] std::string plan_text(const Plan& plan);

/// @return the plan as JSON.
[[nodiscard]] std::string plan_json(const Plan& plan);

/// @return an angle as a text in degrees with four significant digits.
/// @param radian  the angle [rad].
[[nodiscard]] std::string short_degrees(double radian);

}  // namespace axiscal::cli
