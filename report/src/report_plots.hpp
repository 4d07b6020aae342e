// SPDX-License-Identifier: Apache-2.0
// What a calibration shows, as plots.
#pragma once

#include <optional>
#include <vector>

#include "axiscal/report/calibration_report.hpp"
#include "plot.hpp"

namespace axiscal {

/// Residuals by run, face, time, temperature; their normal plot; leverage against residual.
std::vector<Plot> residual_plots(const Calibration& calibration, const Observations* observations);

/// What the faces say; and, where the slope is much larger than they differ, the slope itself.
std::vector<Plot> levelness_plots(const Calibration& calibration);

/// Which source makes how much of the uncertainty of one reading.
std::optional<BarPlot> budget_plot(const Calibration& calibration);

/// Expanded uncertainty over attitudes.
std::vector<HeatMap> uncertainty_maps(const Calibration& calibration);

std::vector<Plot> temperature_plots(const Calibration& calibration);

/// Directions and magnitudes of readings that need no labels.
std::vector<Plot> orientation_plots(const Calibration& calibration,
                                    const Observations* observations);

/// Attitude errors after the turns of a gyroscope.
std::vector<Plot> turn_plots(const Calibration& calibration);

/// Allan deviation of each column, with what was fitted and the dwell time that serves best.
std::vector<Plot> noise_plots(const LogNoise& noise);

std::vector<Plot> history_plots(const UnitHistory& unit);

}  // namespace axiscal
