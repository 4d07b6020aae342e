// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/temperature.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// The readings with temperature scale 0, from which the methods start (method.md, section 6).
///
/// @param set      the readings; temperature.order and temperature.d must be set.
/// @param without  the estimate of the same readings without temperature terms.
/// @throws RankDeficientError  if the temperatures do not determine the terms.
[[nodiscard]] ReadingSet initialize_temperature_terms(const ReadingSet& set,
                                                      const Estimate& without);

/// The number of temperatures of a run: soak levels, or all different temperatures of a continuous
/// run.
[[nodiscard]] int temperature_count(const ReadingSet& set);

/// The corrected Akaike information criterion (AICc) of one axis's regression.
/// @return the criterion; infinity if there are too few readings.
[[nodiscard]] double axis_aicc(double residual_sd, double degrees_of_freedom, double columns);

/// The trial of a temperature order: the AICc of the fit and its test of lack of fit.
/// @return the trial; its AICc is infinity if there are too few readings.
[[nodiscard]] TemperatureOrderTrial trial_of(const ReadingSet& set, const Estimate& estimate);

/// The best order by AICc. As long as the test of lack of fit rejects this order, and does not
/// reject the next one, the next order is taken.
/// @param trials  one trial for each of the orders 0, 1, ...
[[nodiscard]] int chosen_order(const std::vector<TemperatureOrderTrial>& trials);

}  // namespace axiscal
