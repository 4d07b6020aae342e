// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// A part of a run's noise: the weighted sum of squares r' D r of the residuals r, and its expected
/// value and variance for white noise. D is a diagonal matrix of weights. P is the projection onto
/// the residual space.
struct PartOfNoise {
  double squares = 0.0;          // r' D r
  double trace = 0.0;            // trace of P D P: expected value of r' D r for noise of variance 1
  double trace_of_square = 0.0;  // trace of (P D P)^2: half the variance of r' D r

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
/// correlated noise if the score of its correlation test is larger.
inline constexpr double one_sided_5_percent = 1.645;

/// The least number of readings for the tests in add_field_noise() and add_field_wander().
inline constexpr Eigen::Index fewest_looked_at = 8;

}  // namespace axiscal
