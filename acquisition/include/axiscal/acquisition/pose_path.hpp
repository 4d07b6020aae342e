// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// A turn of the cube as a person standing in front of the table makes it, the fence at the back.
enum class CubeTurn {
  tip_away,     ///< a quarter turn over its far edge, towards the fence
  tip_towards,  ///< towards the person
  tip_left,
  tip_right,
  turn_left,  ///< a quarter turn on its rest face, counter-clockwise seen from above
  turn_right,
  turn_round,  ///< half a turn on its rest face
};

/// @return "tip it away from you", ...
[[nodiscard]] std::string_view turn_words(CubeTurn turn);

/// @return the pose of the cube after a turn.
[[nodiscard]] DesignPoint after_turn(const DesignPoint& point, CubeTurn turn);

/// The fewest turns from one way to lie to another; at most three.
[[nodiscard]] std::vector<CubeTurn> fewest_turns(const DesignPoint& from, const DesignPoint& to);

}  // namespace axiscal
