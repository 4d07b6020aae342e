// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/design_quality.hpp"
#include "axiscal/calib/forecast.hpp"
#include "axiscal/calib/tolerance.hpp"

namespace axiscal::cli {

/// The text about a plan.
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

/// A plan for people, 80 columns.
[[nodiscard]] std::string plan_text(const Plan& plan);

/// The same as JSON.
[[nodiscard]] std::string plan_json(const Plan& plan);

/// @return an angle [rad] in degrees, four digits.
[[nodiscard]] std::string short_degrees(double radian);

}  // namespace axiscal::cli
