// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_source.hpp"

namespace axiscal {

/// The estimate of a method. If the set has temperature terms, they are fitted too.
/// @param method  paired, joint or known.
[[nodiscard]] Estimate estimate_by(Method method, const ReadingSet& set, bool by_field);

/// As above, for one-sided axes. The fitted model decides which rows an axis sees; the fit is
/// repeated until the choice stays.
/// @param seen  those rows.
[[nodiscard]] Estimate estimate_one_sided(Method method,
                                          const ReadingSource& source,
                                          const std::vector<FieldDescription>& parts,
                                          AxisMask& seen);

/// Fits all temperature orders that the readings determine: 0, 1, ...
[[nodiscard]] std::vector<TemperatureOrderTrial> try_orders(
    Method method,
    const ReadingSource& source,
    const std::vector<FieldDescription>& parts,
    bool by_field);

}  // namespace axiscal
