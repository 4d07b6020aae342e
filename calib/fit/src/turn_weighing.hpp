// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/turns.hpp"

namespace axiscal {

/// The equations of the turns, linearised about a solution.
struct TurnSystem {
  std::span<const GyroscopeTurn> turns;
  Eigen::VectorXd residuals;  ///< 3 for each turn, in the sensor's frame before the turn [rad]
  Eigen::MatrixXd jacobian;   ///< 3 n x 12: derivatives with respect to the record's parameters
  /// R(T) of each turn: the rotation from the sensor's frame after the turn to that before it
  std::vector<Eigen::Matrix3d> rotations;
  /// The possible effect of the finite sampling rate on the residuals, 3 for each turn; empty if it
  /// is ignored.
  Eigen::VectorXd sampling;
};

/// The weighted solution and its uncertainty.
struct WeighedTurns {
  Eigen::VectorXd step;  ///< change of the 12 parameters from the given solution
  double sd_rad = 0.0;   ///< standard deviation of each component of a turn's own attitude error
  /// standard deviation of each component of the attitude error at a rest, which affects the turns
  /// before and after the rest
  double rest_sd_rad = 0.0;
  /// the smallest number of degrees of freedom of any sensitivity
  double degrees_of_freedom = std::numeric_limits<double>::infinity();
  /// 12 x 12: covariance of the parameters from all causes of scatter
  Eigen::MatrixXd covariance;
  Eigen::VectorXd interval_95;  ///< half widths of the 95 % intervals, from all causes of scatter
  Eigen::VectorXd interval_dof;
  std::vector<ScatterComponent> components;
  std::vector<UncertaintySource> sources;
};

/// Solves the linearised turns by generalised least squares. Each turn has its own error and the
/// errors of the rests at its two ends; restricted likelihood estimates the variances of these
/// errors. Other errors that turns share are unknowns with a prior.
///
/// @param start_sd_rad  approximate standard deviation of each component of a turn's attitude
///                      error.
/// @throws RefusedError  if the turns do not determine the gyroscope's sensitivities and its
///                       uncertain bias.
[[nodiscard]] WeighedTurns weigh_turns(const TurnSystem& system,
                                       const RestFit& rests,
                                       const TurnFitOptions& options,
                                       double start_sd_rad);

/// @return `rests` with a smaller between_rests. The largest contribution that the Earth's rotation
///         can make to between_rests is subtracted, because the actual contribution depends on the
///         unknown heading.
/// @param B  the inverse of the sensitivity [rad/s per unit].
[[nodiscard]] RestFit without_earth(RestFit rests, const Eigen::Matrix3d& B);

}  // namespace axiscal
