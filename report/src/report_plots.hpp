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

/// Plots of the residuals by run, face, time and temperature, a normal plot of the residuals, and a
/// plot of the residuals over leverage. A plot that shows nothing new for this run is left out.
std::vector<Plot> residual_plots(const Calibration& calibration, const Observations* observations);

/// The slope of the table, drawn as a line from the point of a level table; nullopt if the record
/// has no levelness.
std::optional<Plot> slope_plot(const Calibration& calibration);

/// The table's slope estimated from each face; nullopt if there are fewer than two faces.
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
