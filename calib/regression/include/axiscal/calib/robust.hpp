// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// Tukey's bisquare weights for the residuals of a fit.
struct BisquareWeights {
  Eigen::VectorXd weights;  ///< w_i: 1 for a residual of 0; 0 if |u_i| is 1 or more
  double scale = 0.0;       ///< s: robust standard deviation of one residual of weight 1
  /// residual variance of the final fit, divided by scale^2
  double variance_factor = 1.0;
};

/// Computes the weights for one round of iteratively reweighted least squares.
///
///     u_i = r_i / (4.685 s sqrt(1 - h_i)),   w_i = (1 - u_i^2)^2 for |u_i| < 1, else 0
///
/// s is the median of |r_i| / sqrt(1 - h_i), divided by 0.6745. The p - 1 smallest values are left
/// out of the median, because the fit may have made them zero. The variance factor is Huber's:
/// K^2 n^2 / (n - p) sum psi^2 / (sum psi')^2. Here psi is the weighted residual w_i r_i / s, psi'
/// is its derivative, and K is Huber's correction for small samples.
///
/// @param weighted_residuals  r_i: residuals times the square root of their given weights.
/// @param leverage            h_i: leverages of the fit without robust weights.
/// @param parameters          p, the number of parameters.
/// @param smallest_scale      lower limit of s, so that exact data keep their weights.
/// @throws DomainError  if the sizes disagree, or if n <= p.
/// @par Source
/// DuMouchel & O'Brien, "Integrating a robust option into a multiple regression computing
/// environment" (1989); Huber, Robust Statistics (1981), sec. 7.6.
[[nodiscard]] AXISCAL_EXPORT BisquareWeights
bisquare_weights(const Eigen::Ref<const Eigen::VectorXd>& weighted_residuals,
                 const Eigen::Ref<const Eigen::VectorXd>& leverage,
                 double parameters,
                 double smallest_scale = 0.0);

}  // namespace axiscal
