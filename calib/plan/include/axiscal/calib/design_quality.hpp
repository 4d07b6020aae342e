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

/// The quality of a design for the linear regression of one axis's readings on the field. It does
/// not depend on readings.
///
/// Each row of the design matrix X is [1, f^T], where f is the field in the sensor's frame, with
/// length 1. For n readings, the best possible information matrix is X^T X = n diag(1, 1/3, 1/3,
/// 1/3). The efficiencies are relative to this matrix, so the best efficiency is 1.
struct AXISCAL_EXPORT DesignQuality {
  bool determined = false;  ///< if false, efficiencies are 0 and variances infinite
  /// D-efficiency, from det(X^T X)^(1/4). A larger value means a smaller confidence region of the
  /// coefficients.
  double d_efficiency = 0.0;
  /// A-efficiency, from 1 / trace((X^T X)^-1). A larger value means a smaller mean variance of the
  /// coefficients.
  double a_efficiency = 0.0;
  double g_efficiency = 0.0;  ///< G-efficiency, from 1 / largest_prediction_variance
  /// Largest variance of a predicted response over all directions of the field, in units of the
  /// noise variance.
  double largest_prediction_variance = 0.0;
  /// Direction of the field for which the predicted response has its largest variance, in the
  /// instrument's frame.
  Eigen::Vector3d worst_direction = Eigen::Vector3d::Zero();
  /// Variance inflation factor of each sensitivity.
  Eigen::Vector3d variance_inflation = Eigen::Vector3d::Zero();
};

/// Computes the quality of a design.
/// @param design          the design points.
/// @param positioner      the cube. The instrument's mount is nominal.
/// @param field_in_table  the field; only its direction is used.
/// @throws DomainError    if the design is empty or the field zero.
/// @throws RefusedError   if the cube cannot lie at a design point.
/// @par Source
/// Atkinson, Donev & Tobias, Optimum Experimental Designs (2007), ch. 9 to 11; method.md,
/// section 10.
[[nodiscard]] AXISCAL_EXPORT DesignQuality assess_design(const std::vector<DesignEntry>& design,
                                                         const Positioner& positioner,
                                                         const Eigen::Vector3d& field_in_table);

/// A D-optimal choice of n of the 24 design points.
struct OptimalDesign {
  std::vector<DesignEntry> design;
  double d_efficiency = 0.0;  ///< D-efficiency, relative to the upper bound for n readings
  /// D-efficiency of the 12-point design, relative to its own bound.
  double d_efficiency_of_standard = 0.0;
  /// Number of the model's parameters: 10, or 4 with fewer than 10 points.
  int parameters = 10;
};

/// Chooses a D-optimal subset of the 24 design points by exchange of points.
///
/// With ten points or more, each row of the design matrix is [1, vec R_i], where vec R_i contains
/// the nine elements of the cube's rotation at point i. The design then suits every direction of
/// the field, known or unknown. With fewer points, each row is [1, f_i], where f_i is the stated
/// field in the cube's frame at point i.
///
/// @param points          the number n of points, 4 to 24.
/// @param field_in_table  the field; it is used only if n is below 10.
/// @param seed            seed of the random starts; the same seed gives the same design.
/// @throws DomainError  if n is not in 4 to 24.
/// @par Source
/// Fedorov, Theory of Optimal Experiments (1972): one point is exchanged at a time, as long as the
/// determinant grows.
[[nodiscard]] AXISCAL_EXPORT OptimalDesign optimal_design(int points,
                                                          const Eigen::Vector3d& field_in_table,
                                                          std::uint64_t seed);

}  // namespace axiscal
