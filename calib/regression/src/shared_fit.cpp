// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/shared_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "axiscal/core/not_a_number.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

// The fit for given variances of the responses. If the weighted sum of P_k^T P_k is singular, the
// misfit is NaN, and the fit is never accepted as an improvement.
class FitAtVariances {
 public:
  explicit FitAtVariances(const SharedSums& sums)
      : sums_(&sums), root_(sums.shared(), sums.shared()) {}

  // @param at  ln sigma^2 of each response, m entries.
  void evaluate(const Eigen::VectorXd& at) {
    const SharedSums& sums = *sums_;
    log_variance_ = at;
    weight_ = (-at.array()).exp();
    misfit_ = 0.0;
    if (sums.shared() > 0) {
      const PositiveFactor factor(sums.information_at(weight_));
      constexpr double open_below = 1e-13;
      determined_ = factor.is_determined(open_below);
      root_ = factor.root_of_inverse();
      misfit_ = determined_ ? factor.log_determinant() : not_a_number;
    }
    covariance_.noalias() = root_.lazyProduct(root_.transpose());
    gradient_.noalias() = sums.gradient.lazyProduct(weight_);
    estimate_.noalias() = covariance_.lazyProduct(gradient_);
    // With z = estimate, RSS_k = y^T y - z^T P^T y - z^T P^T (y - P z).
    squares_ = sums.squares;
    gradients_ = sums.gradient;
    degrees_of_freedom_ = sums.degrees_of_freedom;
    for (Eigen::Index k = 0; k < at.size(); ++k) {
      const auto information = sums.information_of(k);
      gradients_.col(k).noalias() -= information.lazyProduct(estimate_);
      squares_(k) -= (sums.gradient.col(k) + gradients_.col(k)).dot(estimate_);
      squares_(k) = weight_(k) * std::max(squares_(k), 0.0);
      degrees_of_freedom_(k) -= weight_(k) * information.cwiseProduct(covariance_).sum();
    }
    misfit_ += sums.degrees_of_freedom.dot(log_variance_) + squares_.sum();
  }

  // Returns a step of log_variance() that decreases the misfit.
  // @param lowest     lower limits of log_variance().
  // @param is_newton  receives true if the step is Newton's.
  [[nodiscard]] Eigen::VectorXd newton_step(const Eigen::VectorXd& lowest, bool& is_newton) {
    const SharedSums& sums = *sums_;
    const Eigen::Index m = sums.responses();
    const Eigen::Index D = sums.shared();
    // For each response k, with R = root_ and w_k = weight_(k): column k of `whitened_` contains
    // w_k R^T P_k^T P_k R, and column k of `residual_` is w_k R^T P_k^T (y_k - P_k z).
    whitened_.resize(D * D, m);
    residual_.resize(D, m);
    for (Eigen::Index k = 0; k < m; ++k) {
      product_.noalias() = sums.information_of(k).lazyProduct(root_);
      whitened_.col(k).reshaped(D, D).noalias() =
          weight_(k) * root_.transpose().lazyProduct(product_);
      residual_.col(k).noalias() = weight_(k) * root_.transpose().lazyProduct(gradients_.col(k));
    }
    Eigen::MatrixXd H = -whitened_.transpose().lazyProduct(whitened_) -
                        2.0 * residual_.transpose().lazyProduct(residual_);
    H.diagonal() += sums.degrees_of_freedom - degrees_of_freedom_ + squares_;
    Eigen::VectorXd g = degrees_of_freedom_ - squares_;
    for (Eigen::Index k = 0; k < m; ++k) {
      // A variance at its lower limit is not changed if its step would go below the limit. It then
      // does not affect the steps of the other variances.
      if (!(log_variance_(k) > lowest(k)) && !(g(k) < 0.0)) {
        H.row(k).setZero();
        H.col(k).setZero();
        H(k, k) = 1.0;
        g(k) = 0.0;
      }
    }
    const PositiveFactor factor(H);
    is_newton = factor.is_determined();
    // If the misfit is not convex here, the step goes towards sigma_k^2 = RSS_k / nu_k.
    const Eigen::VectorXd step = is_newton
                                     ? Eigen::VectorXd(-factor.solve(g))
                                     : Eigen::VectorXd(-g.cwiseQuotient(squares_.cwiseMax(1.0)));
    constexpr double longest_step = 2.0;
    return step * std::min(1.0, longest_step / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
  }

  [[nodiscard]] bool determined() const { return determined_; }
  [[nodiscard]] const Eigen::VectorXd& log_variance() const { return log_variance_; }
  // Returns -2 ln of the likelihood, up to a constant.
  [[nodiscard]] double misfit() const { return misfit_; }
  [[nodiscard]] SharedFit result() const {
    return {.variance = log_variance_.array().exp(),
            .degrees_of_freedom = degrees_of_freedom_,
            .estimate = estimate_,
            .covariance = covariance_};
  }

 private:
  const SharedSums* sums_;
  bool determined_ = true;
  double misfit_ = 0.0;
  Eigen::VectorXd log_variance_;        // u = ln sigma^2 of each response, m entries
  Eigen::VectorXd weight_;              // 1 / sigma^2 of each response, m entries
  Eigen::VectorXd degrees_of_freedom_;  // nu of each response, m entries
  Eigen::VectorXd squares_;             // RSS_k / sigma_k^2, m entries
  Eigen::VectorXd estimate_;            // z, the D shared coefficients
  Eigen::VectorXd gradient_;            // sum of P_k^T y_k / sigma_k^2, D entries
  Eigen::MatrixXd gradients_;           // P_k^T (y_k - P_k z), D x m
  Eigen::MatrixXd root_;                // R, D x D
  Eigen::MatrixXd covariance_;          // R R^T, the covariance of z, D x D
  // Kept between the steps, to allocate memory once.
  Eigen::MatrixXd whitened_;
  Eigen::MatrixXd residual_;
  Eigen::MatrixXd product_;
};

// Fits responses without shared coefficients. The variance of each response is its mean square.
SharedFit apart(const SharedSums& sums, const Eigen::VectorXd& smallest) {
  return {.variance = sums.squares.cwiseQuotient(sums.degrees_of_freedom).cwiseMax(smallest),
          .degrees_of_freedom = sums.degrees_of_freedom,
          .estimate = Eigen::VectorXd(0),
          .covariance = Eigen::MatrixXd(0, 0)};
}

}  // namespace

std::optional<SharedFit> fit_shared(const SharedSums& sums,
                                    const Eigen::VectorXd& start,
                                    const Eigen::VectorXd& smallest,
                                    double accuracy) {
  if (sums.shared() == 0 && sums.degrees_of_freedom.minCoeff() > 0.0) {
    return apart(sums, smallest);
  }
  const Eigen::VectorXd lowest = smallest.array().log();
  FitAtVariances best(sums);
  best.evaluate(start.array().log().max(lowest.array()));
  if (!best.determined()) {
    return std::nullopt;
  }
  FitAtVariances next(sums);
  const double readings = sums.degrees_of_freedom.sum();
  constexpr int most_rounds = 100;
  for (int round = 0; round < most_rounds; ++round) {
    bool is_newton = false;
    Eigen::VectorXd step = best.newton_step(lowest, is_newton);
    bool better = false;
    for (int halving = 0; halving < 30 && !better; ++halving) {
      next.evaluate((best.log_variance() + step).cwiseMax(lowest));
      // Rounding errors of the misfit must not cause the last steps to be rejected.
      better = next.misfit() <= best.misfit() + 1e-13 * (readings + std::abs(best.misfit()));
      if (better) {
        std::swap(best, next);
      } else {
        step *= 0.5;
        is_newton = false;
      }
    }
    // After a Newton step, the remaining error is approximately the square of the step.
    const double still = is_newton ? std::sqrt(accuracy) : 0.1 * accuracy;
    if (!better || step.cwiseAbs().maxCoeff() < still) {
      break;
    }
  }
  return best.result();
}

}  // namespace axiscal
