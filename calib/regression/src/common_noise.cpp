// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/common_noise.hpp"

#include <algorithm>

namespace axiscal {

double dof_reduction_factor(const Eigen::MatrixXd& residuals, double degrees_of_freedom) {
  const auto m = static_cast<double>(residuals.cols());
  const Eigen::VectorXd lengths = residuals.colwise().norm();
  if (!(degrees_of_freedom > 1.0) || !(lengths.minCoeff() > 0.0)) {
    return 1.0;
  }
  const Eigen::MatrixXd unit = residuals * lengths.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd R = unit.transpose() * unit;
  // The squared sample correlation of two independent responses has the mean 1 /
  // degrees_of_freedom.
  const double by_chance = (m - 1.0) / degrees_of_freedom;
  return std::clamp(R.squaredNorm() / m - by_chance, 1.0, m);
}

}  // namespace axiscal
