// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// A part of a run's noise: residuals r with weights D, and P the projection onto what the fit
/// leaves.
struct PartOfNoise {
  double squares = 0.0;          // r' D r
  double trace = 0.0;            // of P D P
  double trace_of_square = 0.0;  // of its square

  [[nodiscard]] double freedom() const { return trace * trace / trace_of_square; }
};

/// The levels at which add_field_noise() looks closer: few readings see little, so that the gate
/// opens at less.
struct Gate {
  explicit Gate(Eigen::Index readings) : has_few(readings < few) {}

  static constexpr Eigen::Index few = 24;
  bool has_few;
  double above = has_few ? 0.10 : 0.05;
  double below = has_few ? 0.15 : 0.05;
  double above_of_axis = has_few ? 0.10 : 0.03;
};

/// The score above which add_field_wander() does.
inline constexpr double one_sided_5_percent = 1.645;

/// So many readings are looked at at all.
inline constexpr Eigen::Index fewest_looked_at = 8;

}  // namespace axiscal
