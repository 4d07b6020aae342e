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

// The sums of all responses, as matrices with one column for each response.
struct Sums {
  explicit Sums(const std::vector<ResponseSums>& responses)
      : shared(responses.front().information.cols()),
        information(shared * shared, std::ssize(responses)),
        gradient(shared, std::ssize(responses)),
        squares(std::ssize(responses)),
        degrees_of_freedom(std::ssize(responses)) {
    for (Eigen::Index k = 0; k < squares.size(); ++k) {
      const ResponseSums& own = responses[static_cast<std::size_t>(k)];
      information.col(k) = own.information.reshaped();
      gradient.col(k) = own.gradient;
      squares(k) = own.squares;
      degrees_of_freedom(k) = own.degrees_of_freedom;
    }
  }

  // Returns P_k^T P_k, D x D.
  [[nodiscard]] auto information_of(Eigen::Index k) const {
    return information.col(k).reshaped(shared, shared);
  }

  Eigen::Index shared;          // D, the number of shared coefficients
  Eigen::MatrixXd information;  // P^T P of each response, D^2 x m
  Eigen::MatrixXd gradient;     // P^T y of each response, D x m
  Eigen::VectorXd squares;      // y^T y of each response, m entries
  Eigen::VectorXd degrees_of_freedom;
};

// The fit for given variances of the responses. If the weighted sum of P_k^T P_k is singular, the
// misfit is NaN, and the fit is never accepted as an improvement.
struct AtVariances {
  AtVariances(const Sums& sums, Eigen::VectorXd at)
      : log_variance(std::move(at)), weight((-log_variance.array()).exp()) {
    const Eigen::Index D = sums.shared;
    if (D > 0) {
      const PositiveFactor factor(Eigen::MatrixXd((sums.information * weight).reshaped(D, D)));
      constexpr double open_below = 1e-13;
      determined = factor.is_determined(open_below);
      root = factor.root_of_inverse();
      misfit = determined ? factor.log_determinant() : not_a_number;
    }
    estimate = root * (root.transpose() * (sums.gradient * weight));
    gradients = sums.gradient;
    for (Eigen::Index k = 0; k < weight.size(); ++k) {
      gradients.col(k) -= sums.information_of(k) * estimate;
    }
    // With z = estimate, RSS_k = y^T y - z^T P^T y - z^T P^T (y - P z).
    squares = weight.cwiseProduct(
        (sums.squares - (sums.gradient + gradients).transpose() * estimate).cwiseMax(0.0));
    degrees_of_freedom =
        sums.degrees_of_freedom -
        weight.cwiseProduct(sums.information.transpose() * covariance().reshaped());
    misfit += sums.degrees_of_freedom.dot(log_variance) + squares.sum();
  }

  // Returns the covariance of `estimate`, D x D.
  [[nodiscard]] Eigen::MatrixXd covariance() const { return root * root.transpose(); }

  // Returns a step of log_variance that decreases the misfit.
  // @param lowest     lower limits of log_variance.
  // @param is_newton  receives true if the step is Newton's.
  [[nodiscard]] Eigen::VectorXd newton_step(const Sums& sums,
                                            const Eigen::VectorXd& lowest,
                                            bool& is_newton) const {
    const auto m = log_variance.size();
    const Eigen::VectorXd gradient = degrees_of_freedom - squares;
    // For each response k, with R = root and w_k = weight(k): column k of `information` contains
    // w_k R^T P_k^T P_k R, and column k of `residual` is w_k R^T P_k^T (y_k - P_k z).
    Eigen::MatrixXd information(sums.information.rows(), m);
    const Eigen::MatrixXd residual = root.transpose() * gradients * weight.asDiagonal();
    for (Eigen::Index k = 0; k < m; ++k) {
      information.col(k) =
          (weight(k) * root.transpose() * sums.information_of(k) * root).reshaped();
    }
    Eigen::MatrixXd H =
        -information.transpose() * information - 2.0 * residual.transpose() * residual;
    H.diagonal() += sums.degrees_of_freedom - degrees_of_freedom + squares;
    Eigen::VectorXd g = gradient;
    for (Eigen::Index k = 0; k < m; ++k) {
      // A variance at its lower limit is not changed if its step would go below the limit. It then
      // does not affect the steps of the other variances.
      if (!(log_variance(k) > lowest(k)) && !(gradient(k) < 0.0)) {
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
                                     : Eigen::VectorXd(-g.cwiseQuotient(squares.cwiseMax(1.0)));
    constexpr double longest_step = 2.0;
    return step * std::min(1.0, longest_step / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
  }

  bool determined = true;
  Eigen::VectorXd log_variance;        // u = ln sigma^2 of each response, m entries
  Eigen::VectorXd weight;              // 1 / sigma^2 of each response, m entries
  double misfit = 0.0;                 // -2 ln of the likelihood, up to a constant
  Eigen::VectorXd degrees_of_freedom;  // nu of each response, m entries
  Eigen::VectorXd squares;             // RSS_k / sigma_k^2, m entries
  Eigen::VectorXd estimate;            // z, the D shared coefficients
  Eigen::MatrixXd gradients;           // P_k^T (y_k - P_k z), D x m
  Eigen::MatrixXd root;                // R, D x D: R R^T is the covariance of z
};

// Fits responses without shared coefficients. The variance of each response is its mean square.
SharedFit apart(const std::vector<ResponseSums>& responses, const Eigen::VectorXd& smallest) {
  const auto m = static_cast<Eigen::Index>(responses.size());
  SharedFit fit{.variance = Eigen::VectorXd(m),
                .degrees_of_freedom = Eigen::VectorXd(m),
                .estimate = Eigen::VectorXd(0),
                .covariance = Eigen::MatrixXd(0, 0)};
  for (Eigen::Index k = 0; k < m; ++k) {
    const ResponseSums& own = responses[static_cast<std::size_t>(k)];
    fit.degrees_of_freedom(k) = own.degrees_of_freedom;
    fit.variance(k) = std::max(own.squares / own.degrees_of_freedom, smallest(k));
  }
  return fit;
}

std::optional<AtVariances> least_misfit(const Sums& sums,
                                        const Eigen::VectorXd& start,
                                        const Eigen::VectorXd& smallest) {
  const Eigen::VectorXd lowest = smallest.array().log();
  AtVariances best(sums, start.array().log().max(lowest.array()));
  if (!best.determined) {
    return std::nullopt;
  }
  const double readings = sums.degrees_of_freedom.sum();
  constexpr int most_rounds = 100;
  for (int round = 0; round < most_rounds; ++round) {
    bool is_newton = false;
    Eigen::VectorXd step = best.newton_step(sums, lowest, is_newton);
    bool better = false;
    for (int halving = 0; halving < 30 && !better; ++halving) {
      AtVariances next(sums, (best.log_variance + step).cwiseMax(lowest));
      // Rounding errors of the misfit must not cause the last steps to be rejected.
      better = next.misfit <= best.misfit + 1e-13 * (readings + std::abs(best.misfit));
      if (better) {
        best = std::move(next);
      } else {
        step *= 0.5;
        is_newton = false;
      }
    }
    // After a Newton step, the remaining error is approximately the square of the step.
    const double still = is_newton ? 1e-6 : 1e-13;
    if (!better || step.cwiseAbs().maxCoeff() < still) {
      break;
    }
  }
  return best;
}

}  // namespace

std::optional<SharedFit> fit_shared(const std::vector<ResponseSums>& responses,
                                    const Eigen::VectorXd& start,
                                    const Eigen::VectorXd& smallest) {
  double fewest = std::numeric_limits<double>::infinity();
  for (const ResponseSums& response : responses) {
    fewest = std::min(fewest, response.degrees_of_freedom);
  }
  if (responses.front().information.cols() == 0 && fewest > 0.0) {
    return apart(responses, smallest);
  }
  const std::optional<AtVariances> best = least_misfit(Sums(responses), start, smallest);
  if (!best) {
    return std::nullopt;
  }
  return SharedFit{.variance = best->log_variance.array().exp(),
                   .degrees_of_freedom = best->degrees_of_freedom,
                   .estimate = best->estimate,
                   .covariance = best->covariance()};
}

}  // namespace axiscal
