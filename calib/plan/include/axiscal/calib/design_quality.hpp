// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// How good a design is for the regression of one axis on [1, f], before anything is measured.
///
/// With n readings of unit variance in a field of length 1 the best that any n readings can do is
/// X^T X = n diag(1, 1/3, 1/3, 1/3); the efficiencies are relative to that, 1 for the best.
struct AXISCAL_EXPORT DesignQuality {
  bool determined = false;    ///< else the efficiencies are 0 and the variances infinite
  double d_efficiency = 0.0;  ///< det(X^T X)^(1/4): volume of the coefficients' confidence region
  double a_efficiency = 0.0;  ///< 1 / trace (X^T X)^-1: mean variance of the coefficients
  double g_efficiency = 0.0;  ///< 1 / largest prediction variance
  /// Variance of a predicted response in the worst direction of the field [noise variance], and
  /// that direction in the instrument's frame.
  double largest_prediction_variance = 0.0;
  Eigen::Vector3d worst_direction = Eigen::Vector3d::Zero();
  Eigen::Vector3d variance_inflation = Eigen::Vector3d::Zero();  ///< one for each sensitivity
};

/// @param design          any points.
/// @param positioner      the cube; nominal mount.
/// @param field_in_table  the field; only its direction counts.
/// @throws DomainError    if the design is empty or the field zero.
/// @throws RefusedError   if the cube cannot lie at a point.
/// @par Source
/// Atkinson, Donev & Tobias, Optimum Experimental Designs (2007), ch. 9 to 11; method.md,
/// section 10.
[[nodiscard]] AXISCAL_EXPORT DesignQuality assess_design(const std::vector<DesignEntry>& design,
                                                         const Positioner& positioner,
                                                         const Eigen::Vector3d& field_in_table);

/// The n of the 24 points that determine most.
struct OptimalDesign {
  std::vector<DesignEntry> design;
  double d_efficiency = 0.0;              ///< relative to the bound for any n readings
  double d_efficiency_of_standard = 0.0;  ///< the 12-point design's, relative to its own bound
  int parameters = 10;                    ///< 10, or 4 with fewer than 10 points
};

/// D-optimal subset by exchange.
///
/// From ten points on the model is [1, vec R_i]: optimal for every direction of the field, known or
/// not. With fewer it is [1, f] for the field given.
///
/// @param points          n, 4 to 24.
/// @param field_in_table  used below ten points.
/// @param seed            of the random starts; the same seed gives the same design.
/// @throws DomainError  for another n.
/// @par Source
/// Fedorov, Theory of Optimal Experiments (1972): exchange of one point while the determinant
/// grows.
[[nodiscard]] AXISCAL_EXPORT OptimalDesign optimal_design(int points,
                                                          const Eigen::Vector3d& field_in_table,
                                                          std::uint64_t seed);

}  // namespace axiscal
