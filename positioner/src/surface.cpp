// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/surface.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
void check_adjusters(const std::vector<Eigen::Vector2d>& adjusters) {
  if (adjusters.size() < 3) {
    throw DomainError("a table needs at least three height adjusters that are not in a line");
  }
  Eigen::MatrixXd from_middle(static_cast<Eigen::Index>(adjusters.size()), 2);
  for (std::size_t i = 0; i < adjusters.size(); ++i) {
    from_middle.row(static_cast<Eigen::Index>(i)) = adjusters[i];
  }
  if (!from_middle.allFinite()) {
    throw DomainError("the height adjusters' positions must be finite");
  }
  from_middle.rowwise() -= from_middle.colwise().mean().eval();
  // The eigenvalues of this matrix are the squared spreads along its principal axes.
  const Eigen::Matrix2d scatter = from_middle.transpose() * from_middle;
  const double middle = 0.5 * scatter.trace();
  const double half = std::hypot(0.5 * (scatter(0, 0) - scatter(1, 1)), scatter(0, 1));
  if (!(middle - half > 1e-4 * (middle + half))) {
    throw DomainError("the height adjusters stand in a line; they cannot level the table");
  }
}

std::vector<AdjusterMove> level_table(const Eigen::Vector2d& slope,
                                      const Eigen::Matrix2d& covariance,
                                      const Surface& surface) {
  check_adjusters(surface.adjusters_m);
  if (!(slope.squaredNorm() < 1.0)) {
    throw DomainError("the slope must satisfy X^2 + Y^2 < 1");
  }
  if (surface.thread_pitch_m && !(*surface.thread_pitch_m > 0.0)) {
    throw DomainError("the thread pitch must be positive");
  }
  // Limits of an adjuster's coordinates and of its thread pitch. Larger numbers were probably given
  // in millimetres.
  constexpr double farthest_m = 10.0;
  constexpr double coarsest_m = 0.02;
  for (const Eigen::Vector2d& position : surface.adjusters_m) {
    if (position.cwiseAbs().maxCoeff() > farthest_m) {
      throw DomainError(formatted(
          "an adjuster at {}, {} m is too far away; give positions in metres: 0.1 for 100 mm",
          number_text(position.x()), number_text(position.y())));
    }
  }
  if (surface.thread_pitch_m && *surface.thread_pitch_m > coarsest_m) {
    throw DomainError(formatted(
        "a thread pitch of {} m is too large for an adjuster; give it in metres: 0.001 for M6",
        number_text(*surface.thread_pitch_m)));
  }
  const Eigen::Vector2d gradient = slope / std::sqrt(1.0 - slope.squaredNorm());
  const auto height = [&](const Eigen::Vector2d& position) { return position.dot(gradient); };
  const Eigen::Vector2d highest =
      *std::max_element(surface.adjusters_m.begin(), surface.adjusters_m.end(),
                        [&](const auto& a, const auto& b) { return height(a) < height(b); });
  std::vector<AdjusterMove> moves;
  for (const Eigen::Vector2d& position : surface.adjusters_m) {
    const Eigen::Vector2d lever = highest - position;
    AdjusterMove move{.position_m = position,
                      .raise_m = height(highest) - height(position),
                      .uncertainty_m = std::sqrt(lever.dot(covariance * lever))};
    if (surface.thread_pitch_m) {
      move.turns = move.raise_m / *surface.thread_pitch_m;
    }
    moves.push_back(move);
  }
  return moves;
}

double fence_lean_when_level(const Surface& surface, const Eigen::Vector2d& slope) {
  if (surface.kind == SurfaceKind::one_piece) {
    return surface.fence_lean_rad;
  }
  return surface.fence_lean_rad + std::asin(slope.y());
}

}  // namespace axiscal
