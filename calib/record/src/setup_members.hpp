// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "core/json_members.hpp"

namespace axiscal {

/// What was calibrated, and in which field, as a record's file has them; for both directions.
void members(JsonMembers& io, Instrument& instrument);
void members(JsonMembers& io, FieldDescription& field);

/// An instrument as an experiment states it: as far as it is stated, its axes as set_axes() takes
/// them.
void stated_members(JsonMembers& io, Instrument& instrument);

/// Second fields that the instrument answers to.
/// @param m  number of axes.
void also_members(JsonMembers& io, std::vector<AlsoResponse>& all, Eigen::Index m);

}  // namespace axiscal
