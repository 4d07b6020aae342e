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

// The fit at given variances. If the weighted sum of P_k^T P_k is singular, the misfit is NaN, and
// the fit is never accepted as an improvement.
struct AtVariances {
  AtVariances(const std::vector<ResponseSums>& responses, const Eigen::VectorXd& at)
      : log_variance(at), weight((-at.array()).exp()) {
    const auto m = static_cast<Eigen::Index>(responses.size());
    const Eigen::Index columns = responses.front().information.cols();
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(columns, columns);
    Eigen::VectorXd c = Eigen::VectorXd::Zero(columns);
    for (Eigen::Index k = 0; k < m; ++k) {
      const ResponseSums& own = responses[static_cast<std::size_t>(k)];
      A += weight(k) * own.information;
      c += weight(k) * own.gradient;
    }
    covariance = A;
    if (columns > 0) {
      const PositiveFactor cholesky(A);
      constexpr double open_below = 1e-13;
      determined = cholesky.is_determined(open_below);
      covariance = cholesky.inverse();
      misfit = determined ? cholesky.log_determinant() : not_a_number;
    }
    estimate.noalias() = covariance * c;
    degrees_of_freedom.resize(m);
    squares.resize(m);
    for (Eigen::Index k = 0; k < m; ++k) {
      const ResponseSums& own = responses[static_cast<std::size_t>(k)];
      const Eigen::VectorXd to_estimate = own.information * estimate;
      squares(k) =
          weight(k) *
          std::max(own.squares - 2.0 * estimate.dot(own.gradient) + estimate.dot(to_estimate), 0.0);
      degrees_of_freedom(k) =
          own.degrees_of_freedom - weight(k) * covariance.cwiseProduct(own.information).sum();
      misfit += own.degrees_of_freedom * log_variance(k) + squares(k);
    }
  }

  // Returns a step of log_variance that decreases the misfit.
  // @param lowest     lower limits of log_variance.
  // @param is_newton  receives true if the step is Newton's.
  [[nodiscard]] Eigen::VectorXd newton_step(const std::vector<ResponseSums>& responses,
                                            const Eigen::VectorXd& lowest,
                                            bool& is_newton) const {
    const auto m = log_variance.size();
    const Eigen::VectorXd gradient = degrees_of_freedom - squares;
    // A variance at its lower limit is not changed if its step would go below the limit. It then
    // does not affect the steps of the others.
    const auto is_open = [&](Eigen::Index k) {
      return log_variance(k) > lowest(k) || gradient(k) < 0.0;
    };
    Eigen::MatrixXd gradients(estimate.size(), m);  // P_k^T (y_k - P_k z) / sigma_k^2
    for (Eigen::Index k = 0; k < m; ++k) {
      const ResponseSums& own = responses[static_cast<std::size_t>(k)];
      gradients.col(k) = weight(k) * (own.gradient - own.information * estimate);
    }
    Eigen::MatrixXd H = Eigen::MatrixXd::Identity(m, m);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(m);
    for (Eigen::Index k = 0; k < m; ++k) {
      if (!is_open(k)) {
        continue;
      }
      const Eigen::MatrixXd CA =
          weight(k) * covariance * responses[static_cast<std::size_t>(k)].information;
      const Eigen::MatrixXd CAC = CA * covariance;
      const Eigen::VectorXd Cg = covariance * gradients.col(k);
      g(k) = gradient(k);
      H(k, k) = CA.trace() + squares(k);
      for (Eigen::Index l = 0; l < m; ++l) {
        if (is_open(l)) {
          H(k, l) -=
              weight(l) *
                  CAC.cwiseProduct(responses[static_cast<std::size_t>(l)].information).sum() +
              2.0 * Cg.dot(gradients.col(l));
        }
      }
    }
    const PositiveFactor cholesky(H);
    is_newton = cholesky.is_determined();
    // If the likelihood is not convex, the step goes towards sigma_k^2 = RSS_k / nu_k.
    const Eigen::VectorXd step = is_newton
                                     ? Eigen::VectorXd(-cholesky.solve(g))
                                     : Eigen::VectorXd(-g.cwiseQuotient(squares.cwiseMax(1.0)));
    constexpr double longest_step = 2.0;
    return step * std::min(1.0, longest_step / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
  }

  bool determined = true;
  Eigen::VectorXd log_variance;        // u, m
  Eigen::VectorXd weight;              // 1 / sigma^2, m
  double misfit = 0.0;                 // -2 ln of the likelihood, up to a constant
  Eigen::VectorXd degrees_of_freedom;  // nu, m
  Eigen::VectorXd squares;             // RSS_k / sigma_k^2, m
  Eigen::VectorXd estimate;            // z, D
  Eigen::MatrixXd covariance;          // covariance of z, D x D
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

std::optional<AtVariances> least_misfit(const std::vector<ResponseSums>& responses,
                                        const Eigen::VectorXd& start,
                                        const Eigen::VectorXd& smallest) {
  const Eigen::VectorXd lowest = smallest.array().log();
  AtVariances best(responses, start.array().log().max(lowest.array()).matrix());
  if (!best.determined) {
    return std::nullopt;
  }
  double readings = 0.0;
  for (const ResponseSums& response : responses) {
    readings += response.degrees_of_freedom;
  }
  constexpr int most_rounds = 100;
  for (int round = 0; round < most_rounds; ++round) {
    bool is_newton = false;
    Eigen::VectorXd step = best.newton_step(responses, lowest, is_newton);
    bool better = false;
    for (int halving = 0; halving < 30 && !better; ++halving) {
      AtVariances next(responses, (best.log_variance + step).cwiseMax(lowest));
      // Rounding of the likelihood must not stop the last steps.
      better = next.misfit <= best.misfit + 1e-13 * (readings + std::abs(best.misfit));
      if (better) {
        best = std::move(next);
      } else {
        step *= 0.5;
        is_newton = false;
      }
    }
    // The remaining error of Newton's step is approximately its square.
    const double still = is_newton ? 1e-8 : 1e-13;
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
  const std::optional<AtVariances> best = least_misfit(responses, start, smallest);
  if (!best) {
    return std::nullopt;
  }
  return SharedFit{.variance = best->log_variance.array().exp(),
                   .degrees_of_freedom = best->degrees_of_freedom,
                   .estimate = best->estimate,
                   .covariance = best->covariance};
}

}  // namespace axiscal
