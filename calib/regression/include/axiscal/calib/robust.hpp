// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// Tukey's bisquare weights for the residuals of a fit.
struct BisquareWeights {
  Eigen::VectorXd weights;       ///< 1 for a residual of 0, 0 from 4.685 scaled residuals on
  double scale = 0.0;            ///< robust standard deviation of one residual of weight 1
  double variance_factor = 1.0;  ///< s^2 of the final fit: scale^2 variance_factor
};

/// One round of iteratively reweighted least squares.
///
///     u_i = r_i / (4.685 s sqrt(1 - h_i)),   w_i = (1 - u_i^2)^2 for |u_i| < 1, else 0
///
/// s is the median absolute deviation / 0.6745, without the p - 1 smallest residuals, because the
/// fit may have made them zero. variance_factor is Huber's: K^2 n / (n - p) * sum psi^2 / (sum
/// psi')^2 * n.
///
/// @param weighted_residuals  residuals times the square root of their given weights.
/// @param leverage            of the fit without robust weights.
/// @param parameters          p.
/// @param smallest_scale      s is at least this, so that exact data keep their weights.
/// @throws DomainError  if sizes disagree or there are not more residuals than parameters.
/// @par Source
/// DuMouchel & O'Brien, "Integrating a robust option into a multiple regression computing
/// environment" (1989); Huber, Robust Statistics (1981), sec. 7.6.
[[nodiscard]] AXISCAL_EXPORT BisquareWeights
bisquare_weights(const Eigen::Ref<const Eigen::VectorXd>& weighted_residuals,
                 const Eigen::Ref<const Eigen::VectorXd>& leverage,
                 double parameters,
                 double smallest_scale = 0.0);

}  // namespace axiscal
