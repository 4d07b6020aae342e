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

/// Plots of the residuals by run, face, time and temperature, a normal plot, and a plot of the
/// residuals against leverage. A plot is left out if it would add no information for this run.
std::vector<Plot> residual_plots(const Calibration& calibration, const Observations* observations);

/// Plot of the table's slope as a line from the origin to the measured slope. The origin stands for
/// a level table. The result is nullopt if the record has no levelness.
std::optional<Plot> slope_plot(const Calibration& calibration);

/// Plot of the table's slope, estimated from each face; nullopt for fewer than two faces.
std::optional<Plot> faces_plot(const Calibration& calibration);

/// Plot of the contribution of each source to the uncertainty of one reading.
std::optional<BarPlot> budget_plot(const Calibration& calibration);

/// Maps of the expanded uncertainty over all attitudes. A map of nearly equal values is left out.
std::vector<HeatMap> uncertainty_maps(const Calibration& calibration);

std::vector<Plot> temperature_plots(const Calibration& calibration);

/// Plot of the calibrated magnitudes; nullopt unless the calibration has the method magnitude.
std::optional<Plot> magnitude_plot(const Calibration& calibration);

/// Plots of the attitude errors after the turns of a gyroscope.
std::vector<Plot> turn_plots(const Calibration& calibration);

std::vector<Plot> history_plots(const UnitHistory& unit);

}  // namespace axiscal
