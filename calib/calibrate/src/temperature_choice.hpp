// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// @return whether nobody said how temperatures are to be taken, and labelled readings bring enough
///         of them to look: at two soak levels or more, or 24 readings at temperatures that vary.
[[nodiscard]] bool has_temperatures_enough(const Experiment& experiment,
                                           const Observations& observations);

/// @return true if an order above 0 is significant: without an effect of temperature, fewer than
///         one run in a thousand would show such an improvement.
[[nodiscard]] bool clearly_needed(const std::vector<TemperatureOrderTrial>& trials);

/// Warns where readings have temperatures that no term of the fit describes, although they span
/// much or the residuals follow them.
/// @param fields  in the table, as fitted.
void warn_of_ignored_temperature(const Experiment& experiment,
                                 const ReadingSet& set,
                                 const TableField& field,
                                 Calibration& calibration);

}  // namespace axiscal
