// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// @return true if no temperature options are stated and the temperatures of the readings suffice
///         to choose an order of the temperature terms: there are two or more soak levels, or 24 or
///         more readings at varying temperatures.
[[nodiscard]] bool has_temperatures_enough(const Experiment& experiment,
                                           const Observations& observations);

/// @return true if an order above 0 improves the fit by so much that this would happen in fewer
///         than 1 of 1,000 runs in which the temperature has no effect.
[[nodiscard]] bool clearly_needed(const std::vector<TemperatureOrderTrial>& trials);

/// Warns if the fit has no temperature terms although the temperatures span a wide range, or the
/// residuals are correlated with the temperatures.
/// @param field  the fitted field, in the table's frame.
void warn_of_ignored_temperature(const Experiment& experiment,
                                 const ReadingSet& set,
                                 const TableField& field,
                                 Calibration& calibration);

}  // namespace axiscal
