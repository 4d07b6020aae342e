// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/temperature.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// Returns the readings with starting values of the temperature terms: the coefficients c of the
/// temperature scale are 0 (method.md, section 6).
///
/// @param set      the readings; temperature.order and temperature.d must be set.
/// @param without  the estimate of the same readings without temperature terms.
/// @throws RankDeficientError  if the temperatures do not determine the terms.
[[nodiscard]] ReadingSet initialize_temperature_terms(const ReadingSet& set,
                                                      const Estimate& without);

/// Returns the number of soak levels of a run or, if the temperature changes continuously, the
/// number of different temperatures.
[[nodiscard]] int temperature_count(const ReadingSet& set);

/// Computes the corrected Akaike information criterion (AICc) of one axis's regression.
/// @return the criterion; infinity if there are too few readings.
[[nodiscard]] double axis_aicc(double residual_sd, double degrees_of_freedom, double columns);

/// Tests the temperature order of an estimate: computes the AICc of the fit and the test of its
/// lack of fit.
/// @return the results for this order; the AICc is infinity if there are too few readings.
[[nodiscard]] TemperatureOrderTrial trial_of(const ReadingSet& set, const Estimate& estimate);

/// Chooses the order with the smallest AICc. As long as the test of lack of fit rejects the chosen
/// order but not the next one, the next order is chosen instead.
/// @param trials  one trial for each of the orders 0, 1, ...
[[nodiscard]] int chosen_order(const std::vector<TemperatureOrderTrial>& trials);

}  // namespace axiscal
