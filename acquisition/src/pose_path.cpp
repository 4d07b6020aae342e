// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/pose_path.hpp"

#include <array>
#include <deque>
#include <map>

#include <Eigen/Geometry>

#include "axiscal/positioner/facing.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {
namespace {

struct TurnDefinition {
  CubeTurn turn;
  std::string_view words;
  Eigen::Vector3d axis;  // rotation axis in the table's frame: x to the right, y to the fence, z up
  int quarters;
};

const std::array<TurnDefinition, 7>& turns() {
  static const std::array<TurnDefinition, 7> all = {{
      {CubeTurn::tip_away, "tip it away from you", -Eigen::Vector3d::UnitX(), 1},
      {CubeTurn::tip_towards, "tip it towards you", Eigen::Vector3d::UnitX(), 1},
      {CubeTurn::tip_left, "tip it to the left", -Eigen::Vector3d::UnitY(), 1},
      {CubeTurn::tip_right, "tip it to the right", Eigen::Vector3d::UnitY(), 1},
      {CubeTurn::turn_left, "turn it a quarter to the left", Eigen::Vector3d::UnitZ(), 1},
      {CubeTurn::turn_right, "turn it a quarter to the right", -Eigen::Vector3d::UnitZ(), 1},
      {CubeTurn::turn_round, "turn it by half a turn", Eigen::Vector3d::UnitZ(), 2},
  }};
  return all;
}

// Rotates a direction by `turn.quarters` quarter turns about `turn.axis`.
Eigen::Vector3d turned(Eigen::Vector3d direction, const TurnDefinition& turn) {
  for (int i = 0; i < turn.quarters; ++i) {
    direction = turn.axis * turn.axis.dot(direction) + turn.axis.cross(direction);
  }
  return direction;
}

}  // namespace

std::string_view turn_words(CubeTurn turn) {
  return turns()[static_cast<std::size_t>(turn)].words;
}

DesignPoint after_turn(const DesignPoint& point, CubeTurn turn) {
  static const Positioner cube;
  const Eigen::Matrix3d& rotation_table_from_positioner =
      cube.rotation_table_from_positioner(point);
  const TurnDefinition& definition = turns()[static_cast<std::size_t>(turn)];
  // The result consists of the faces that point down and to the fence after the turn.
  Eigen::Matrix3d rotation_after;
  for (int j = 0; j < 3; ++j) {
    rotation_after.col(j) = turned(rotation_table_from_positioner.col(j), definition);
  }
  return {nearest_face(-rotation_after.transpose() * Eigen::Vector3d::UnitZ()),
          nearest_face(rotation_after.transpose() * Eigen::Vector3d::UnitY())};
}

std::vector<CubeTurn> fewest_turns(const DesignPoint& from, const DesignPoint& to) {
  std::map<DesignPoint, std::vector<CubeTurn>> reached = {{from, {}}};
  std::deque<DesignPoint> next = {from};
  while (!next.empty() && !reached.contains(to)) {
    const DesignPoint here = next.front();
    next.pop_front();
    for (const TurnDefinition& turn : turns()) {
      std::vector<CubeTurn> way = reached.at(here);
      way.push_back(turn.turn);
      if (reached.emplace(after_turn(here, turn.turn), way).second) {
        next.push_back(after_turn(here, turn.turn));
      }
    }
  }
  return reached.at(to);
}

}  // namespace axiscal
