// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// A sequence of rotations that stores repeated rotations only once. An instrument lies in few
/// orientations, so most rotations are equal to a recent one. References are valid until the next
/// push_back() or put().
class Rotations {
 public:
  Rotations() = default;
  Rotations(std::initializer_list<Eigen::Matrix3d> rotations) {
    for (const Eigen::Matrix3d& rotation : rotations) {
      push_back(rotation);
    }
  }

  [[nodiscard]] const Eigen::Matrix3d& operator[](std::size_t i) const { return distinct_[at_[i]]; }
  [[nodiscard]] const Eigen::Matrix3d& back() const { return distinct_[at_.back()]; }
  [[nodiscard]] std::size_t size() const { return at_.size(); }
  [[nodiscard]] bool empty() const { return at_.empty(); }

  void reserve(std::size_t count) {
    constexpr std::size_t mostly = 24;
    at_.reserve(count);
    distinct_.reserve(std::min(count, mostly));
  }
  void push_back(const Eigen::Matrix3d& rotation) { at_.push_back(place_of(rotation)); }
  void put(std::size_t i, const Eigen::Matrix3d& rotation) { at_[i] = place_of(rotation); }
  void clear() {
    at_.clear();
    distinct_.clear();
  }

 private:
  // Only the most recent distinct rotations are searched. An older rotation may be stored twice,
  // which costs only memory.
  std::uint32_t place_of(const Eigen::Matrix3d& rotation) {
    constexpr std::size_t latest = 32;
    const std::size_t count = std::min(latest, distinct_.size());
    const auto found =
        std::find(distinct_.end() - static_cast<std::ptrdiff_t>(count), distinct_.end(), rotation);
    if (found == distinct_.end()) {
      distinct_.push_back(rotation);
      return static_cast<std::uint32_t>(distinct_.size() - 1);
    }
    return static_cast<std::uint32_t>(found - distinct_.begin());
  }

  std::vector<Eigen::Matrix3d> distinct_;
  std::vector<std::uint32_t> at_;
};

}  // namespace axiscal
