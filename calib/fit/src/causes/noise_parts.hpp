// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// A part of a run's noise: the residuals r with a diagonal matrix D of weights. P is the
/// projection onto the residual space.
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

/// The score above which add_field_wander() fits models of the noise.
inline constexpr double one_sided_5_percent = 1.645;

/// The least number of readings for which these causes are examined.
inline constexpr Eigen::Index fewest_looked_at = 8;

}  // namespace axiscal
