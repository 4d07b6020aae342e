// SPDX-License-Identifier: Apache-2.0
// The plots of a calibration report.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/report/calibration_report.hpp"
#include "report/src/plot.hpp"

namespace axiscal {

inline const std::string& axis_name(const Calibration& calibration, Eigen::Index k) {
  return calibration.sensor.instrument.axes[static_cast<std::size_t>(k)];
}

/// Plots of the residuals by run, face, time and temperature, their normal plot, and residuals over
/// leverage. A plot without information in this run is left out.
std::vector<Plot> residual_plots(const Calibration& calibration, const Observations* observations);

/// The slope of the table as a line from level; nullopt without levelness.
std::optional<Plot> slope_plot(const Calibration& calibration);

/// The slopes by face, enlarged; nullopt with fewer than two faces.
std::optional<Plot> faces_plot(const Calibration& calibration);

/// The contribution of each source to the uncertainty of one reading.
std::optional<BarPlot> budget_plot(const Calibration& calibration);

/// Maps of the expanded uncertainty over attitudes. A map without variation is left out.
std::vector<HeatMap> uncertainty_maps(const Calibration& calibration);

std::vector<Plot> temperature_plots(const Calibration& calibration);

/// The calibrated magnitudes; nullopt unless the method is magnitude.
std::optional<Plot> magnitude_plot(const Calibration& calibration);

/// Attitude errors after the turns of a gyroscope.
std::vector<Plot> turn_plots(const Calibration& calibration);

std::vector<Plot> history_plots(const UnitHistory& unit);

}  // namespace axiscal
