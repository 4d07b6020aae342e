// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/seat.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

namespace axiscal {
namespace {

constexpr double largest_turn_rad = 0.3;
constexpr double touching_fence_m = 1e-12;  // a foot within this distance touches the fence
constexpr double same_turn_rad = 1e-9;

// Two feet that touch the fence in a stable seat: the third foot does not reach the fence, and the
// cube's centre is between the two along the fence.
struct StablePair {
  std::array<int, 2> contacts;
  double turn_rad = 0.0;
  double distance_m = 0.0;  // distance from the cube's centre to the fence
};

class Push {
 public:
  Push(const Eigen::Matrix3d& rotation_table_from_positioner, const Feet& feet, double lean_rad)
      : cos_lean_(std::cos(lean_rad)), sin_lean_(std::sin(lean_rad)) {
    for (std::size_t i = 0; i < feet.size(); ++i) {
      centre_[i] = rotation_table_from_positioner * feet[i].centre_m;
      radius_[i] = feet[i].radius_m;
    }
  }

  [[nodiscard]] std::vector<StablePair> stable_pairs() const {
    std::vector<StablePair> stable;
    for (const auto& [i, j, third] : {std::array{0, 1, 2}, {1, 2, 0}, {2, 0, 1}}) {
      for (const double turn : turns_at_which_both_touch(i, j)) {
        const double distance = reach(i, turn);
        const bool is_clear = reach(third, turn) <= distance + touching_fence_m;
        const bool holds = along(i, turn) * along(j, turn) <= 0.0;
        if (is_clear && holds) {
          stable.push_back({.contacts = {i, j}, .turn_rad = turn, .distance_m = distance});
        }
      }
    }
    return stable;
  }

 private:
  [[nodiscard]] std::vector<double> turns_at_which_both_touch(int i, int j) const {
    const Eigen::Vector3d c = centre_[at(i)] - centre_[at(j)];
    const double across = std::hypot(c.x(), c.y());
    const double sine =
        (radius_[at(j)] - radius_[at(i)] - c.z() * sin_lean_) / (cos_lean_ * across);
    if (!(std::abs(sine) <= 1.0)) {
      return {};
    }
    std::vector<double> turns;
    for (const double angle : {std::asin(sine), std::numbers::pi - std::asin(sine)}) {
      const double turn = std::remainder(angle - std::atan2(c.y(), c.x()), 2.0 * std::numbers::pi);
      if (std::abs(turn) <= largest_turn_rad) {
        turns.push_back(turn);
      }
    }
    return turns;
  }

  // Returns how far a ball extends from the cube's centre towards the fence [m].
  [[nodiscard]] double reach(int i, double turn) const {
    const Eigen::Vector3d& c = centre_[at(i)];
    return cos_lean_ * (c.x() * std::sin(turn) + c.y() * std::cos(turn)) + c.z() * sin_lean_ +
           radius_[at(i)];
  }

  // Returns the position of a ball's contact point along the fence [m].
  [[nodiscard]] double along(int i, double turn) const {
    const Eigen::Vector3d& c = centre_[at(i)];
    return c.x() * std::cos(turn) - c.y() * std::sin(turn);
  }

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  std::array<Eigen::Vector3d, 3> centre_;
  std::array<double, 3> radius_{};
  double cos_lean_;
  double sin_lean_;
};

}  // namespace

Seat seat_at_fence(const Eigen::Matrix3d& rotation_table_from_positioner,
                   const Feet& fence_feet,
                   double lean_rad) {
  Seat seat{.rotation_table_from_positioner = rotation_table_from_positioner};
  const std::vector<StablePair> stable =
      Push(rotation_table_from_positioner, fence_feet, lean_rad).stable_pairs();
  if (stable.empty()) {
    seat.defect =
        "the cube is not stable at the fence: two feet of the fence face must touch it, with the "
        "cube's centre between them";
    return seat;
  }
  // Chooses the seat nearest to the fence. If distances are equal, the smallest turn decides. If
  // the turns are equal too, the first pair is taken. If all three feet touch the fence, all pairs
  // give the same seat.
  const StablePair& best =
      *std::min_element(stable.begin(), stable.end(), [](const StablePair& a, const StablePair& b) {
        return std::abs(a.distance_m - b.distance_m) > touching_fence_m
                   ? a.distance_m < b.distance_m
                   : std::abs(a.turn_rad) < std::abs(b.turn_rad) - same_turn_rad;
      });
  seat.contacts = best.contacts;
  seat.turn_rad = best.turn_rad;
  seat.rocks = std::any_of(stable.begin(), stable.end(), [&](const StablePair& other) {
    return std::abs(other.turn_rad - best.turn_rad) > same_turn_rad;
  });
  if (best.turn_rad != 0.0) {
    seat.rotation_table_from_positioner =
        Eigen::AngleAxisd(best.turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
        rotation_table_from_positioner;
  }
  return seat;
}

}  // namespace axiscal
