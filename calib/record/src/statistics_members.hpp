// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "axiscal/calib/calibration.hpp"
#include "core/json_members.hpp"

namespace axiscal {

/// `rest` and `fence` of a design point; nullopt if the file lacks them.
void point_members(JsonMembers& io, std::optional<DesignPoint>& point);

/// The statistics of a fit, as a record's file has them; for both directions.
/// @param m  number of axes.
void members(JsonMembers& io, FitStatistics& statistics, Eigen::Index m);

}  // namespace axiscal
