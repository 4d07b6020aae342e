// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/common_noise.hpp"

#include <algorithm>
#include <cmath>

namespace axiscal {

double dof_reduction_factor(const Eigen::MatrixXd& residuals, double degrees_of_freedom) {
  const auto m = static_cast<double>(residuals.cols());
  const Eigen::VectorXd lengths = residuals.colwise().norm();
  if (!(degrees_of_freedom > 1.0) || !(lengths.minCoeff() > 0.0)) {
    return 1.0;
  }
  const Eigen::MatrixXd unit = residuals * lengths.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd R = unit.transpose() * unit;
  const double excess = R.squaredNorm() / m - 1.0;
  // With the true correlation rho, the squared sample correlation has a bias of approximately
  // (1 - rho^2)^2 / degrees_of_freedom. Each response has m - 1 correlations with the others.
  const double mean_square = m > 1.0 ? std::min(excess / (m - 1.0), 1.0) : 0.0;
  const double bias = (m - 1.0) * std::pow(1.0 - mean_square, 2) / degrees_of_freedom;
  return std::clamp(1.0 + excess - bias, 1.0, m);
}

}  // namespace axiscal
