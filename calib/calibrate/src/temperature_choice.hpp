// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// @return true if the temperature options are not stated and the readings have enough temperatures
///         to choose an order: two or more soak levels, or 24 or more readings at temperatures that
///         vary.
[[nodiscard]] bool has_temperatures_enough(const Experiment& experiment,
                                           const Observations& observations);

/// @return true if an order above 0 improves the fit so much that fewer than one run in a thousand
///         would show this improvement without an effect of temperature.
[[nodiscard]] bool clearly_needed(const std::vector<TemperatureOrderTrial>& trials);

/// Warns if the fit lacks temperature terms although the temperatures span a wide range or the
/// residuals follow them.
/// @param field  the field of the fit, in the table's frame.
void warn_of_ignored_temperature(const Experiment& experiment,
                                 const ReadingSet& set,
                                 const TableField& field,
                                 Calibration& calibration);

}  // namespace axiscal
