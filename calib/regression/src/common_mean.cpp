// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/common_mean.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/calib/distributions.hpp"

namespace axiscal {

CommonMean common_mean(const Eigen::VectorXd& x, const Eigen::VectorXd& u) {
  const auto left = static_cast<double>(x.size() - 1);
  const auto mean_at = [&](double tau2, double& excess) {
    const Eigen::ArrayXd w = (u.array().square() + tau2).inverse();
    const double mean = (w * x.array()).sum() / w.sum();
    excess = (w * (x.array() - mean).square()).sum() - left;
    return mean;
  };
  CommonMean result;
  double excess = 0.0;
  double low = 0.0;
  result.mean = mean_at(0.0, excess);
  result.p_value = chi_squared_upper_p(std::max(excess + left, 1e-12), left);
  if (excess > 0.0) {
    double high = (x.array() - x.mean()).square().sum() + u.squaredNorm();
    constexpr int halvings = 100;
    for (int i = 0; i < halvings; ++i) {
      const double middle = 0.5 * (low + high);
      result.mean = mean_at(middle, excess);
      (excess > 0.0 ? low : high) = middle;
    }
  }
  const Eigen::ArrayXd w = (u.array().square() + low).inverse();
  result.between = std::sqrt(low);
  result.u = std::sqrt((w * (x.array() - result.mean).square()).sum() / (left * w.sum()));
  result.u_within = 1.0 / std::sqrt(u.array().square().inverse().sum());
  // `slope` is minus the expected derivative of the weighted sum of squares with respect to tau^2.
  const double slope = w.sum() - w.square().sum() / w.sum();
  result.between_degrees_of_freedom = std::max(1.0, low * low * slope * slope / left);
  return result;
}

}  // namespace axiscal
