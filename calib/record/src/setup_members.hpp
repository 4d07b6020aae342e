// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "core/json_members.hpp"

namespace axiscal {

/// The instrument and the field in a record's file, for both directions.
void members(JsonMembers& io, Instrument& instrument);
void members(JsonMembers& io, FieldDescription& field);

/// An instrument in an experiment file: the stated members, with its axes in the form that
/// set_axes() takes.
void stated_members(JsonMembers& io, Instrument& instrument);

/// Second fields that the instrument answers to.
/// @param m  number of axes.
void also_members(JsonMembers& io, std::vector<AlsoResponse>& all, Eigen::Index m);

}  // namespace axiscal
