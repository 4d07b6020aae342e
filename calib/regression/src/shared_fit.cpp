// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/shared_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "axiscal/calib/scaled_cholesky.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

// Of variances at which the sum of the P_k^T P_k has no root the misfit is not a number, and so
// never less than another.
struct AtVariances {
  AtVariances(const std::vector<ResponseSums>& responses, const Eigen::VectorXd& at)
      : log_variance(at) {
    const auto m = static_cast<Eigen::Index>(responses.size());
    const Eigen::Index columns = responses.front().information.cols();
    const Eigen::VectorXd weight = (-log_variance.array()).exp();
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(columns, columns);
    Eigen::VectorXd c = Eigen::VectorXd::Zero(columns);
    for (Eigen::Index k = 0; k < m; ++k) {
      const ResponseSums& own = responses[static_cast<std::size_t>(k)];
      information.emplace_back(weight(k) * own.information);
      A += information.back();
      c += weight(k) * own.gradient;
    }
    covariance = A;
    if (columns > 0) {
      const ScaledCholesky cholesky(A);
      constexpr double open_below = 1e-13;
      determined = cholesky.is_determined(open_below);
      covariance = cholesky.inverse();
      misfit = determined ? cholesky.log_determinant() : not_a_number;
    }
    estimate = covariance * c;
    degrees_of_freedom.resize(m);
    squares.resize(m);
    for (Eigen::Index k = 0; k < m; ++k) {
      const ResponseSums& own = responses[static_cast<std::size_t>(k)];
      const Eigen::VectorXd to_estimate = own.information * estimate;
      gradients.emplace_back(weight(k) * (own.gradient - to_estimate));
      squares(k) =
          weight(k) *
          std::max(own.squares - 2.0 * estimate.dot(own.gradient) + estimate.dot(to_estimate), 0.0);
      degrees_of_freedom(k) =
          own.degrees_of_freedom -
          covariance.cwiseProduct(information[static_cast<std::size_t>(k)]).sum();
      misfit += own.degrees_of_freedom * log_variance(k) + squares(k);
    }
  }

  // Towards the least misfit among variances that are not below the lowest.
  [[nodiscard]] Eigen::VectorXd newton_step(const Eigen::VectorXd& lowest) const {
    const auto m = log_variance.size();
    const Eigen::VectorXd gradient = degrees_of_freedom - squares;
    std::vector<Eigen::Index> open;
    for (Eigen::Index k = 0; k < m; ++k) {
      if (log_variance(k) > lowest(k) || gradient(k) < 0.0) {
        open.push_back(k);
      }
    }
    const auto count = static_cast<Eigen::Index>(open.size());
    Eigen::MatrixXd H(count, count);
    Eigen::VectorXd g(count);
    for (Eigen::Index a = 0; a < count; ++a) {
      const auto k = static_cast<std::size_t>(open[static_cast<std::size_t>(a)]);
      const auto own = static_cast<Eigen::Index>(k);
      const Eigen::MatrixXd CA = covariance * information[k];
      const Eigen::MatrixXd CAC = CA * covariance;
      const Eigen::VectorXd Cg = covariance * gradients[k];
      g(a) = gradient(own);
      for (Eigen::Index b = 0; b < count; ++b) {
        const auto l = static_cast<std::size_t>(open[static_cast<std::size_t>(b)]);
        H(a, b) = -CAC.cwiseProduct(information[l]).sum() - 2.0 * Cg.dot(gradients[l]);
      }
      H(a, a) += CA.trace() + squares(own);
    }
    const Eigen::LLT<Eigen::MatrixXd> cholesky(H);
    const Eigen::VectorXd newton = cholesky.solve(g);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(m);
    for (Eigen::Index a = 0; a < count; ++a) {
      const Eigen::Index k = open[static_cast<std::size_t>(a)];
      // Where the likelihood is not convex: what sigma_k^2 = RSS_k / nu_k asks for, at least by its
      // sign.
      step(k) = cholesky.info() == Eigen::Success ? -newton(a) : -g(a) / std::max(squares(k), 1.0);
    }
    constexpr double longest_step = 2.0;
    return step * std::min(1.0, longest_step / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
  }

  bool determined = true;
  Eigen::VectorXd log_variance;              // u, m
  double misfit = 0.0;                       // -2 ln of the likelihood, but for a constant
  Eigen::VectorXd degrees_of_freedom;        // nu, m
  Eigen::VectorXd squares;                   // RSS_k / sigma_k^2, m
  Eigen::VectorXd estimate;                  // z, D
  Eigen::MatrixXd covariance;                // how well z is known
  std::vector<Eigen::MatrixXd> information;  // P_k^T P_k / sigma_k^2
  std::vector<Eigen::VectorXd> gradients;    // P_k^T (y_k - P_k z) / sigma_k^2
};

// With nothing in common each has its mean square.
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

}  // namespace

std::optional<SharedFit> fit_shared(const std::vector<ResponseSums>& responses,
                                    const Eigen::VectorXd& start,
                                    const Eigen::VectorXd& smallest) {
  double readings = 0.0;
  double fewest = std::numeric_limits<double>::infinity();
  for (const ResponseSums& response : responses) {
    readings += response.degrees_of_freedom;
    fewest = std::min(fewest, response.degrees_of_freedom);
  }
  if (responses.front().information.cols() == 0 && fewest > 0.0) {
    return apart(responses, smallest);
  }
  const Eigen::VectorXd lowest = smallest.array().log();
  AtVariances best(responses, start.array().log().max(lowest.array()).matrix());
  if (!best.determined) {
    return std::nullopt;
  }
  constexpr int most_rounds = 100;
  for (int round = 0; round < most_rounds; ++round) {
    Eigen::VectorXd step = best.newton_step(lowest);
    bool better = false;
    for (int halving = 0; halving < 30 && !better; ++halving) {
      AtVariances next(responses, (best.log_variance + step).cwiseMax(lowest));
      // Rounding of the likelihood must not stop the last steps.
      better = next.misfit <= best.misfit + 1e-13 * (readings + std::abs(best.misfit));
      if (better) {
        best = std::move(next);
      } else {
        step *= 0.5;
      }
    }
    if (!better || step.cwiseAbs().maxCoeff() < 1e-13) {
      break;
    }
  }
  return SharedFit{.variance = best.log_variance.array().exp(),
                   .degrees_of_freedom = std::move(best.degrees_of_freedom),
                   .estimate = std::move(best.estimate),
                   .covariance = std::move(best.covariance)};
}

}  // namespace axiscal
