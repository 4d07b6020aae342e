// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_source.hpp"

namespace axiscal {

/// What a method gives, over temperature too where the set has its terms.
/// @param method  paired, joint or known.
[[nodiscard]] Estimate estimate_by(Method method, const ReadingSet& set, bool by_field);

/// The same for one-sided axes: which rows an axis sees is decided by the fitted model, until it
/// stays.
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
