// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace axiscal {

/// The gyroscope's readings during one turn, from a rest to the next: samples of three axes with
/// their times.
struct TurnSamples {
  std::array<std::span<const double>, 3> rate;  ///< readings v, n samples each
  std::span<const double> time_s;               ///< n times, ascending
};

/// The result of a turn: the attitude at its end, and its derivative with respect to B.
struct IntegratedTurn {
  /// R(T) as a unit quaternion (w, x, y, z): to the sensor's frame at the start from that at the
  /// end.
  std::array<double, 4> attitude = {1.0, 0.0, 0.0, 0.0};
  /// Column 3 p + q: the small rotation, in the sensor's frame at the start, that R(T) turns by for
  /// a unit change of B_pq: the integral of R(t) e_p (v - b)_q dt.
  std::array<std::array<double, 9>, 3> sensitivity{};
  /// The integral of R(t) dt [s]: a bias that is wrong by e turns R(T) by it times B e.
  std::array<std::array<double, 3>, 3> rotation_integral{};
};

/// Turns that are integrated again and again with other candidates of B: packed once, eight side by
/// side.
///
///     dR/dt = R [w cross],   w = B (v - b)
///
/// w is taken as linear between samples; each step is the rotation vector
/// (w0 + w1) dt / 2 + (w0 cross w1) dt^2 / 12 (Magnus series, of fourth order).
///
/// @par Source
/// method.md, section 4, turns; A. Iserles et al., "Lie-group methods", Acta Numerica 9 (2000).
class PackedTurns {
 public:
  /// @param turns  their readings v.
  /// @param bias   b, of each axis; v - b is packed.
  explicit PackedTurns(std::span<const TurnSamples> turns, const std::array<double, 3>& bias = {});

  /// @return how many turns.
  [[nodiscard]] std::size_t size() const { return place_.size(); }

  /// @param B  3 x 3, row by row: angular rate per reading [rad/s per unit].
  /// @return one result for each turn, in the order given.
  [[nodiscard]] std::vector<IntegratedTurn> integrate(std::span<const double, 9> B) const;

  /// The same in plain code: the reference.
  [[nodiscard]] std::vector<IntegratedTurn> integrate_plain(std::span<const double, 9> B) const;

 private:
  struct Group {
    std::size_t steps = 0;
    std::size_t first = 0;  // of its numbers
  };
  template <typename Integrator>
  [[nodiscard]] std::vector<IntegratedTurn> integrated_by(const Integrator& integrate_group,
                                                          std::span<const double, 9> B) const;

  std::vector<Group> groups_;
  // Per sample: x, y, z, time step to it, each for eight turns. All groups in one piece of memory,
  // which fits of one turn set after another then give each other.
  std::vector<double> samples_;
  std::vector<std::size_t> place_;  // for each turn its group times eight, and its lane
};

}  // namespace axiscal
