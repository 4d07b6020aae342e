// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "core/json_members.hpp"

namespace axiscal {

/// Reads or writes the instrument or the field of a record file.
void members(JsonMembers& io, Instrument& instrument);
void members(JsonMembers& io, FieldDescription& field);

/// Reads or writes the instrument of an experiment file. All of its members are optional. The axes
/// are in the form of set_axes(): "x", or "d=p-n" for a difference.
void stated_members(JsonMembers& io, Instrument& instrument);

/// Reads or writes the responses to additional fields.
/// @param m  number of axes.
void also_members(JsonMembers& io, std::vector<AlsoResponse>& all, Eigen::Index m);

}  // namespace axiscal
