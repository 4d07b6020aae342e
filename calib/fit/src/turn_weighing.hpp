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
  /// What the sampling may make of the residuals, 3 for each turn; empty: not looked at.
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

/// Generalised least squares of turns whose errors are their own and those of the rests at their
/// ends, by restricted likelihood; what they share besides is an unknown with a prior. Linear in
/// the turns.
///
/// @param start_sd_rad  of a component of a turn's error, roughly.
/// @throws RefusedError  where the turns do not determine the gyroscope beside its uncertain bias.
[[nodiscard]] WeighedTurns weigh_turns(const TurnSystem& system,
                                       const RestFit& rests,
                                       const TurnFitOptions& options,
                                       double start_sd_rad);

}  // namespace axiscal
