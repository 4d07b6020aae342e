// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace axiscal {

/// The readings of a gyroscope during a turn, which is the motion from one period at rest to the
/// next: samples of three axes, and their times.
struct TurnSamples {
  std::array<std::span<const double>, 3> rate;  ///< readings v, n samples for each axis
  std::span<const double> time_s;               ///< n times, ascending
};

/// The result for one turn: the attitude at its end, and the derivative of this attitude with
/// respect to the matrix B (see PackedTurns).
struct IntegratedTurn {
  /// R(T), the rotation from the sensor's frame at the end to the sensor's frame at the start, as a
  /// unit quaternion (w, x, y, z).
  std::array<double, 4> attitude = {1.0, 0.0, 0.0, 0.0};
  /// Derivatives of R(T) with respect to the entries of B. Column 3 p + q is the small rotation per
  /// unit of B_pq, as a vector in the sensor's frame at the start. It is the integral of
  /// R(t) e_p (v - b)_q dt, where e_p is the unit vector of axis p.
  std::array<std::array<double, 9>, 3> sensitivity{};
  /// The integral of R(t) dt [s]. An error e of the bias rotates R(T) by this integral times B e.
  std::array<std::array<double, 3>, 3> rotation_integral{};
};

/// Turns of a gyroscope that are stored once, in groups of eight, and integrated many times with
/// different matrices B. R(t) is the attitude, w the angular rate, v a reading and b the bias:
///
///     dR/dt = R [w cross],   w = B (v - b)
///
/// The rate w is assumed to be linear between samples. If w0 and w1 are the rates at two successive
/// samples and dt is the time between them, the rotation vector of this step is
/// (w0 + w1) dt / 2 + (w0 cross w1) dt^2 / 12 (Magnus series of fourth order).
///
/// @par Source
/// method.md, section 4, turns; A. Iserles et al., "Lie-group methods", Acta Numerica 9 (2000).
class PackedTurns {
 public:
  /// @param turns  the readings v of each turn.
  /// @param bias   b for each axis; v - b is stored.
  explicit PackedTurns(std::span<const TurnSamples> turns, const std::array<double, 3>& bias = {});

  /// @return the number of turns.
  [[nodiscard]] std::size_t size() const { return place_.size(); }

  /// @param B  3 x 3, row by row: angular rate per reading [rad/s per unit].
  /// @return one result for each turn, in the order of the constructor's `turns`.
  [[nodiscard]] std::vector<IntegratedTurn> integrate(std::span<const double, 9> B) const;

  /// Plain version of integrate(), as a reference for tests.
  [[nodiscard]] std::vector<IntegratedTurn> integrate_plain(std::span<const double, 9> B) const;

 private:
  struct Group {
    std::size_t steps = 0;
    std::size_t first = 0;  // index of the group's first number in samples_
  };
  template <typename Integrator>
  [[nodiscard]] std::vector<IntegratedTurn> integrated_by(const Integrator& integrate_group,
                                                          std::span<const double, 9> B) const;

  std::vector<Group> groups_;
  // For each sample of a group: x, y, z and the time step that ends at the sample, each for eight
  // turns. All groups share one allocation, so that its memory can be reused for the next set of
  // turns.
  std::vector<double> samples_;
  std::vector<std::size_t> place_;  // for each turn: 8 times the index of its group, plus its lane
};

}  // namespace axiscal
