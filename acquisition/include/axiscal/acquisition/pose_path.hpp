// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// A turn of the cube, as seen by a person in front of the table. The fence, a stop that the cube
/// touches, is at the far side.
enum class CubeTurn {
  tip_away,     ///< a quarter turn over its far edge, towards the fence
  tip_towards,  ///< a quarter turn over its near edge, towards the person
  tip_left,
  tip_right,
  turn_left,  ///< a quarter turn about the vertical, counter-clockwise seen from above
  turn_right,
  turn_round,  ///< half a turn about the vertical
};

/// @return the instruction for a turn: "tip it away from you", ...
[[nodiscard]] std::string_view turn_words(CubeTurn turn);

/// @return the pose of the cube after a turn.
[[nodiscard]] DesignPoint after_turn(const DesignPoint& point, CubeTurn turn);

/// @return the shortest sequence of turns from one pose to another; at most three turns.
[[nodiscard]] std::vector<CubeTurn> fewest_turns(const DesignPoint& from, const DesignPoint& to);

}  // namespace axiscal
