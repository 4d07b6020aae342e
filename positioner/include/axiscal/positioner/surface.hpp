// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// How table and fence belong together.
enum class SurfaceKind {
  one_piece,  ///< L-shaped: the fence tilts with the table, its lean stays
  separate,   ///< the fence stands by itself: levelling the table changes its lean
};

/// The surface that the cube is laid on, and its fence.
struct Surface {
  SurfaceKind kind = SurfaceKind::one_piece;
  /// Perpendicularity error: the fence leans over the table by this; its normal in the table's
  /// frame is (0, cos, sin) [rad].
  double fence_lean_rad = 0.0;
  std::vector<Eigen::Vector2d> adjusters_m;  ///< where the table stands on its height adjusters
  std::optional<double> thread_pitch_m;      ///< height that one turn of an adjuster raises [m]
};

/// The correction of one height adjuster.
struct AXISCAL_EXPORT AdjusterMove {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< frame table
  double raise_m = 0.0;                                  ///< not negative
  double uncertainty_m = 0.0;  ///< standard uncertainty of raise_m, from the slope's
  std::optional<double> turns;
};

/// @throws DomainError  unless there are three or more, finite, and not in a line.
AXISCAL_EXPORT void check_adjusters(const std::vector<Eigen::Vector2d>& adjusters_m);

/// The heights that level a table, by raising only: the highest adjuster stays.
///
/// With the field's direction (x, y, z) in the table, z = sqrt(1 - x^2 - y^2), an adjuster at
/// (a, b) stands h = (a x + b y) / z too high, and is raised by the largest h less its own.
///
/// @param slope       the table's slope as Levelness: x > 0 means that it rises towards +x.
/// @param covariance  of the slope, 2 x 2 [rad^2].
/// @param surface     its adjusters, three or more that are not in a line; its thread pitch.
/// @throws DomainError  if there are too few adjusters, they stand in a line, a number is not
///                      finite, the pitch is not positive, or the slope is not below 1.
/// @par Source
/// method.md, section 9; US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT std::vector<AdjusterMove> level_table(
    const Eigen::Vector2d& slope, const Eigen::Matrix2d& covariance, const Surface& surface);

/// The fence's lean once the table is level: unchanged for one piece; a fence that stands by itself
/// keeps its direction in the room while the table turns under it by the slope's y.
[[nodiscard]] AXISCAL_EXPORT double fence_lean_when_level(const Surface& surface,
                                                          const Eigen::Vector2d& slope);

}  // namespace axiscal
