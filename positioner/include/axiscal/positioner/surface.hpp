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
  one_piece,  ///< the fence tilts with the table, so that levelling does not change its lean
  separate,   ///< the fence has its own support, so that levelling the table changes its lean
};

/// The table on which the cube is laid, and its fence.
struct Surface {
  SurfaceKind kind = SurfaceKind::one_piece;
  /// Angle by which the fence leans over the table, a perpendicularity error [rad]. The fence's
  /// normal is (0, cos(lean), sin(lean)), frame table.
  double fence_lean_rad = 0.0;
  std::vector<Eigen::Vector2d> adjusters_m;  ///< positions of the height adjusters, frame table
  std::optional<double> thread_pitch_m;      ///< height by which one turn moves an adjuster [m]
};

/// The correction of one height adjuster.
struct AXISCAL_EXPORT AdjusterMove {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< adjuster's position, frame table
  double raise_m = 0.0;        ///< height by which to raise the adjuster, never negative
  double uncertainty_m = 0.0;  ///< standard uncertainty of raise_m, due to the slope's uncertainty
  std::optional<double> turns;
};

/// @throws DomainError  unless there are at least three finite positions that are not in a line.
AXISCAL_EXPORT void check_adjusters(const std::vector<Eigen::Vector2d>& adjusters_m);

/// Computes how much to raise each height adjuster to level a table. The highest adjuster does not
/// move.
///
/// If (x, y, z) is the upward vertical in the table's frame, with z = sqrt(1 - x^2 - y^2), an
/// adjuster at (a, b) is too high by h = (a x + b y) / z. It is raised by the largest h of all
/// adjusters minus its own h.
///
/// @param slope       components of a vertical unit vector along the table's x and y axes. For
///                    small angles they are the slope in radians. If the component along x is
///                    positive, the table rises towards +x.
/// @param covariance  covariance of the slope, 2 x 2 [rad^2].
/// @param surface     the table. It has three or more adjusters that are not in a line. Only the
///                    adjusters and the thread pitch are used.
/// @throws DomainError  if there are too few adjusters, they stand in a line, a number is not
///                      finite, the pitch is not positive, or the slope is not below 1.
/// @par Source
/// method.md, section 9; US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT std::vector<AdjusterMove> level_table(
    const Eigen::Vector2d& slope, const Eigen::Matrix2d& covariance, const Surface& surface);

/// Computes the fence's lean after the table is levelled [rad]. If table and fence are one piece,
/// the lean does not change. A separate fence keeps its direction in the room, so its lean changes
/// by the arcsine of the slope's y.
[[nodiscard]] AXISCAL_EXPORT double fence_lean_when_level(const Surface& surface,
                                                          const Eigen::Vector2d& slope);

}  // namespace axiscal
