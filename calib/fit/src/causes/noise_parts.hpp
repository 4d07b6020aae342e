// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// A part of a run's noise. It contains the residuals r with weights, which are the elements of a
/// diagonal matrix D. P is the projection onto the residual space.
struct PartOfNoise {
  double squares = 0.0;          // r' D r
  double trace = 0.0;            // trace of P D P
  double trace_of_square = 0.0;  // trace of (P D P)^2

  [[nodiscard]] double freedom() const { return trace * trace / trace_of_square; }
};

/// The p-values below which add_field_noise() widens intervals. They are larger for few readings,
/// because the tests then detect less.
struct Gate {
  explicit Gate(Eigen::Index readings) : has_few(readings < few) {}

  static constexpr Eigen::Index few = 24;
  bool has_few;
  double above = has_few ? 0.10 : 0.05;
  double below = has_few ? 0.15 : 0.05;
  double above_of_axis = has_few ? 0.10 : 0.03;
};

/// The 95 % quantile of the standard normal distribution. add_field_wander() fits models of
/// correlated noise if its score is larger.
inline constexpr double one_sided_5_percent = 1.645;

/// The least number of readings for the tests in add_field_noise() and add_field_wander().
inline constexpr Eigen::Index fewest_looked_at = 8;

}  // namespace axiscal
