// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/turns.hpp"

namespace axiscal {

/// Turns as they are seen from a solution.
struct TurnSystem {
  std::span<const GyroscopeTurn> turns;
  Eigen::VectorXd residuals;               ///< 3 for each turn, frame before [rad]
  Eigen::MatrixXd jacobian;                ///< 3 n x 12, of the record's parameters
  std::vector<Eigen::Matrix3d> rotations;  ///< R(T) of each: before from after
  /// The possible effect of the sampling on the residuals, 3 for each turn; empty if ignored.
  Eigen::VectorXd sampling;
};

/// Where the weighed solution lies, and how well it is known.
struct WeighedTurns {
  Eigen::VectorXd step;      ///< from the solution, of the record's 12 parameters
  double sd_rad = 0.0;       ///< of a component of a turn's error
  double rest_sd_rad = 0.0;  ///< of a component of a rest's, which two turns share
  double degrees_of_freedom = std::numeric_limits<double>::infinity();  ///< least of a sensitivity
  Eigen::MatrixXd covariance;                                           ///< 12 x 12, by all scatter
  Eigen::VectorXd interval_95;  ///< half width for each parameter, by all scatter
  Eigen::VectorXd interval_dof;
  std::vector<ScatterComponent> components;
  std::vector<UncertaintySource> sources;
};

/// Generalised least squares, linear in the turns. A turn has its own error and the errors of the
/// rests at its ends; restricted likelihood estimates the variances. Other shared errors are
/// unknowns with a prior.
///
/// @param start_sd_rad  of a component of a turn's error, roughly.
/// @throws RefusedError  if the turns do not determine the gyroscope and its uncertain bias.
[[nodiscard]] WeighedTurns weigh_turns(const TurnSystem& system,
                                       const RestFit& rests,
                                       const TurnFitOptions& options,
                                       double start_sd_rad);

/// @return the rests, with the Earth's rotation taken off the change of the bias from rest to rest:
///         at most its rate, as the heading is unknown.
/// @param B  rad/s per unit.
[[nodiscard]] RestFit without_earth(RestFit rests, const Eigen::Matrix3d& B);

}  // namespace axiscal
