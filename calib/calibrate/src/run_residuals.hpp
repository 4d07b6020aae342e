// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_source.hpp"

namespace axiscal {

/// Residuals of all readings, left out or not, in the order of the file.
///
/// @param fields  in the table, as fitted; empty: the readings bring their fields, or lack labels.
/// @param used    which readings each axis used, a row for each of the observations.
[[nodiscard]] std::vector<ReadingResidual> residuals_of(const Observations& observations,
                                                        const ReadingSource& source,
                                                        const TableField& field,
                                                        const Positioner& positioner,
                                                        const Calibration& calibration,
                                                        const AxisMask& used);

}  // namespace axiscal
