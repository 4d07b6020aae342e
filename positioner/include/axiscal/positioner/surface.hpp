// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// How the fence is connected to the table.
enum class SurfaceKind {
  one_piece,  ///< L-shaped: the fence tilts with the table, so that its lean does not change
  separate,   ///< the fence has its own support, so that levelling the table changes its lean
};

/// The surface that the cube is laid on, and its fence.
struct Surface {
  SurfaceKind kind = SurfaceKind::one_piece;
  /// Angle by which the fence leans over the table, a perpendicularity error [rad]. The fence's
  /// normal is (0, cos(lean), sin(lean)), frame table.
  double fence_lean_rad = 0.0;
  std::vector<Eigen::Vector2d> adjusters_m;  ///< positions of the height adjusters, frame table
  std::optional<double> thread_pitch_m;      ///< height of one turn of an adjuster [m]
};

/// The correction of one height adjuster.
struct AXISCAL_EXPORT AdjusterMove {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< frame table
  double raise_m = 0.0;                                  ///< height to raise it, never negative
  double uncertainty_m = 0.0;  ///< standard uncertainty of raise_m, from that of the slope
  std::optional<double> turns;
};

/// @throws DomainError  unless there are at least three finite positions that are not in a line.
AXISCAL_EXPORT void check_adjusters(const std::vector<Eigen::Vector2d>& adjusters_m);

/// Computes how much to raise each height adjuster to level a table. The highest adjuster does not
/// move.
///
/// With the field's direction (x, y, z) in the table, z = sqrt(1 - x^2 - y^2), an adjuster at (a,
/// b) is too high by h = (a x + b y) / z. It is raised by the largest h minus its own h.
///
/// @param slope       components of a vertical unit vector along the table's x and y axes, which
///                    for small angles are the slope in radians; x > 0: the table rises towards +x.
/// @param covariance  covariance of the slope, 2 x 2 [rad^2].
/// @param surface     gives the adjusters, three or more that are not in a line, and the thread
///                    pitch.
/// @throws DomainError  if there are too few adjusters, they stand in a line, a number is not
///                      finite, the pitch is not positive, or the slope is not below 1.
/// @par Source
/// method.md, section 9; US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT std::vector<AdjusterMove> level_table(
    const Eigen::Vector2d& slope, const Eigen::Matrix2d& covariance, const Surface& surface);

/// The fence's lean after the table is levelled [rad]. For `one_piece` it does not change. A
/// separate fence keeps its direction in the room, so its lean changes by the slope's y.
[[nodiscard]] AXISCAL_EXPORT double fence_lean_when_level(const Surface& surface,
                                                          const Eigen::Vector2d& slope);

}  // namespace axiscal
