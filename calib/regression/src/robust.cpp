// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/robust.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "calib/regression/reweighting.hpp"

namespace axiscal {
namespace {

constexpr double tuning = 4.685;  // gives an efficiency of 95 % for normal errors

double median_without_smallest(const Eigen::VectorXd& values, Eigen::Index left_out) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const auto first = static_cast<std::size_t>(left_out);
  const std::size_t count = sorted.size() - first;
  const double upper = sorted[first + count / 2];
  return count % 2 == 1 ? upper : 0.5 * (upper + sorted[first + count / 2 - 1]);
}

}  // namespace

BisquareWeights bisquare_weights(const Eigen::Ref<const Eigen::VectorXd>& weighted_residuals,
                                 const Eigen::Ref<const Eigen::VectorXd>& leverage,
                                 double parameters,
                                 double smallest_scale) {
  const Eigen::Index n = weighted_residuals.size();
  const auto p = static_cast<Eigen::Index>(std::ceil(parameters));
  if (leverage.size() != n || n <= p) {
    throw DomainError("bisquare_weights: more residuals than parameters are needed");
  }
  const Eigen::ArrayXd rest = (1.0 - leverage.array()).max(1e-4).sqrt();
  const Eigen::ArrayXd adjusted = weighted_residuals.array() / rest;
  BisquareWeights result;
  result.scale =
      std::max(median_without_smallest(adjusted.abs().matrix(), p - 1) / 0.6745, smallest_scale);
  if (!(result.scale > 0.0)) {
    result.weights = Eigen::VectorXd::Ones(n);
    return result;
  }
  const Eigen::ArrayXd u = adjusted / (tuning * result.scale);
  const Eigen::ArrayXd inside = (u.abs() < 1.0).cast<double>();
  const Eigen::ArrayXd root = inside * (1.0 - u.square());
  result.weights = root.square().matrix();
  // psi = x w, where x = 4.685 u is the residual divided by the scale. The derivative with respect
  // to x is psi' = (1 - u^2)(1 - 5 u^2).
  const auto count = static_cast<double>(n);
  const Eigen::ArrayXd psi = tuning * u * root.square();
  const Eigen::ArrayXd slope = root * (1.0 - 5.0 * u.square());
  const double mean_slope = slope.mean();
  const double slope_variance = (slope - mean_slope).square().mean();
  const double K = 1.0 + parameters / count * slope_variance / (mean_slope * mean_slope);
  result.variance_factor = K * K * (rest.square() * psi.square()).sum() / (count - parameters) /
                           (mean_slope * mean_slope);
  return result;
}

Eigen::MatrixXd reweight_until_converged(Eigen::Index rows,
                                         Eigen::Index columns,
                                         const std::function<Eigen::MatrixXd()>& weigh,
                                         const std::function<void(const Eigen::MatrixXd&)>& fit) {
  constexpr int most_rounds = 100;
  constexpr double still = 1e-9;
  Eigen::MatrixXd weights = Eigen::MatrixXd::Ones(rows, columns);
  double change = 1.0;
  for (int round = 0; round < most_rounds && !(change < still); ++round) {
    Eigen::MatrixXd next = weigh();
    change = (next - weights).cwiseAbs().maxCoeff();
    weights = std::move(next);
    fit(weights);
  }
  return weights;
}

}  // namespace axiscal
