// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_source.hpp"

namespace axiscal {

/// Computes the residuals of all readings, including those left out, in the order of the file.
///
/// @param field  the fitted field. It has no vectors if each reading has its own stated field, or
///               if the readings have no design points.
/// @param used   n x m; entry (i, k) is true if the fit of axis k used reading i.
[[nodiscard]] std::vector<ReadingResidual> residuals_of(const Observations& observations,
                                                        const ReadingSource& source,
                                                        const TableField& field,
                                                        const Positioner& positioner,
                                                        const Calibration& calibration,
                                                        const AxisMask& used);

}  // namespace axiscal
