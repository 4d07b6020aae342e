// SPDX-License-Identifier: Apache-2.0
// What a calibration shows, as plots.
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

/// Residuals by run, face, time, temperature; their normal plot; leverage against residual: those
/// that can tell something in this run.
std::vector<Plot> residual_plots(const Calibration& calibration, const Observations* observations);

/// The table's slope from level; nullopt without levelness.
std::optional<Plot> slope_plot(const Calibration& calibration);

/// The slopes by face, enlarged.
std::optional<Plot> faces_plot(const Calibration& calibration);

/// Which source makes how much of the uncertainty of one reading.
std::optional<BarPlot> budget_plot(const Calibration& calibration);

/// Expanded uncertainty over attitudes, if it varies over the attitudes.
std::vector<HeatMap> uncertainty_maps(const Calibration& calibration);

std::vector<Plot> temperature_plots(const Calibration& calibration);

/// Of method magnitude: the calibrated magnitudes.
std::optional<Plot> magnitude_plot(const Calibration& calibration);

/// Attitude errors after the turns of a gyroscope.
std::vector<Plot> turn_plots(const Calibration& calibration);

std::vector<Plot> history_plots(const UnitHistory& unit);

}  // namespace axiscal
