// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_source.hpp"

namespace axiscal {

/// Computes the estimate of a method. If the set has temperature terms, they are fitted too.
/// @param method  a method that has a method_fit().
[[nodiscard]] Estimate estimate_by(Method method, const ReadingSet& set, bool by_field);

/// Like estimate_by(), for one-sided axes. The fitted model determines which readings each axis
/// uses; the fit is repeated until this selection no longer changes.
/// @param seen  receives the selection, n x m.
[[nodiscard]] Estimate estimate_one_sided(Method method,
                                          const ReadingSource& source,
                                          const std::vector<FieldDescription>& parts,
                                          AxisMask& seen);

/// Fits the temperature orders 0, 1 and 2, as far as the readings determine them.
[[nodiscard]] std::vector<TemperatureOrderTrial> try_orders(
    Method method,
    const ReadingSource& source,
    const std::vector<FieldDescription>& parts,
    bool by_field);

}  // namespace axiscal
