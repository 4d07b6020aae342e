// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_source.hpp"

namespace axiscal {

/// Fits the readings by a method. If the set has temperature terms, they are fitted too.
/// @param method  a method for which method_fit() has an entry.
[[nodiscard]] Estimate estimate_by(Method method, const ReadingSet& set, bool by_field);

/// Like estimate_by(), for one-sided axes. The fitted model determines which readings each axis
/// uses. The fit is therefore repeated until this selection no longer changes.
/// @param seen  receives the selection, n x m.
[[nodiscard]] Estimate estimate_one_sided(Method method,
                                          const ReadingSource& source,
                                          const std::vector<FieldDescription>& parts,
                                          AxisMask& seen);

/// Fits polynomials of the orders 0, 1 and 2 in the temperature, up to the highest order that the
/// readings determine.
[[nodiscard]] std::vector<TemperatureOrderTrial> try_orders(
    Method method,
    const ReadingSource& source,
    const std::vector<FieldDescription>& parts,
    bool by_field);

}  // namespace axiscal
