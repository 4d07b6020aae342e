// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <Eigen/Core>

#include "axiscal/calib/experiment.hpp"

namespace axiscal {

/// @return whether the field turns in the table while readings are taken, as the sun does, or one
/// of
///         the user's own that says so.
[[nodiscard]] bool field_moves(const Experiment& experiment);

/// @return what moves, for messages: "the sun's place", "the field NAME" of a user's own; else
/// empty.
[[nodiscard]] std::string moving_field_name(const Experiment& experiment);

/// How the field changes in the table: its value at one time becomes that at the other, by a turn
/// times the ratio of their lengths.
///
/// @param from_s, to_s  seconds since 1970-01-01, UTC.
/// @return frame table; the identity where the field does not move.
/// @throws SetupError  if it moves and the fence's azimuth is not stated, or it is not alone.
[[nodiscard]] Eigen::Matrix3d change_of_field(const Experiment& experiment,
                                              double from_s,
                                              double to_s);

/// As make_field_description(), of a field that moves at a time.
/// @param time_s  seconds since 1970-01-01, UTC.
/// @throws RefusedError  if the sun is below the horizon.
[[nodiscard]] FieldDescription make_field_description(const Experiment& experiment, double time_s);

}  // namespace axiscal
