// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "axiscal/calib/calibration.hpp"
#include "core/json_members.hpp"

namespace axiscal {

/// Reads or writes the keys `rest` and `fence` of a design point. If the file lacks them, `point`
/// does not change. If `point` is nullopt, they are not written.
void point_members(JsonMembers& io, std::optional<DesignPoint>& point);

/// Reads or writes the statistics of a fit in a record file.
/// @param m  number of axes.
void members(JsonMembers& io, FitStatistics& statistics, Eigen::Index m);

}  // namespace axiscal
