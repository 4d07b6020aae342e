// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/shared_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "axiscal/calib/fixed_cholesky.hpp"
#include "axiscal/calib/product_of_size.hpp"
#include "axiscal/calib/scaled_cholesky.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

// How many coefficients, and responses, there are, where that is known, and how many at most: few
// need no memory of their own.
template <int ColumnCount, int ResponseCount, int MostColumns, int MostResponses>
struct SharedSize {
  using OfColumns = Eigen::Matrix<double, ColumnCount, 1, 0, MostColumns, 1>;
  using Covariance = Eigen::Matrix<double, ColumnCount, ColumnCount, 0, MostColumns, MostColumns>;
  using OfResponses = Eigen::Matrix<double, ResponseCount, 1, 0, MostResponses, 1>;
  using Columns = Eigen::Matrix<double, ColumnCount, ResponseCount, 0, MostColumns, MostResponses>;
  using AmongResponses =
      Eigen::Matrix<double, ResponseCount, ResponseCount, 0, MostResponses, MostResponses>;

  template <typename Left, typename Right>
  static auto product(const Left& left, const Right& right) {
    return product_of_size<MostColumns>(left, right);
  }

  // H^-1 g; nothing where H is not positive definite.
  static std::optional<OfResponses> solved(const AmongResponses& H, const OfResponses& g) {
    if constexpr (ResponseCount == Eigen::Dynamic) {
      const Eigen::LLT<AmongResponses> cholesky(H);
      return cholesky.info() == Eigen::Success ? std::optional<OfResponses>(cholesky.solve(g))
                                               : std::nullopt;
    } else {
      const FixedCholesky<ResponseCount> cholesky(H);
      return cholesky.is_positive() ? std::optional<OfResponses>(cholesky.solve(g)) : std::nullopt;
    }
  }
};
using SharedOfAny = SharedSize<Eigen::Dynamic, Eigen::Dynamic, Eigen::Dynamic, Eigen::Dynamic>;
constexpr int few = 6;
using SharedOfFew = SharedSize<Eigen::Dynamic, Eigen::Dynamic, few, few>;
using SharedDirection = SharedSize<2, 3, 2, 3>;  // of three axes in one field

// Sums of one response.
template <typename S>
struct FixedSums {
  template <typename Sums>
  explicit FixedSums(const Sums& response)
      : information(response.information),
        gradient(response.gradient),
        squares(response.squares),
        degrees_of_freedom(response.degrees_of_freedom) {}

  typename S::Covariance information;
  typename S::OfColumns gradient;
  double squares;
  double degrees_of_freedom;
};

// Of variances at which the sum of the P_k^T P_k has no root the misfit is not a number, and so
// never less than another.
template <typename S>
struct AtVariances {
  using Covariance = typename S::Covariance;
  using OfColumns = typename S::OfColumns;
  using OfResponses = typename S::OfResponses;

  AtVariances(const std::vector<FixedSums<S>>& responses, const OfResponses& at)
      : log_variance(at), weight((-at.array()).exp()) {
    const auto m = static_cast<Eigen::Index>(responses.size());
    const Eigen::Index columns = responses.front().information.cols();
    Covariance A = Covariance::Zero(columns, columns);
    OfColumns c = OfColumns::Zero(columns);
    for (Eigen::Index k = 0; k < m; ++k) {
      const FixedSums<S>& own = responses[static_cast<std::size_t>(k)];
      A += weight(k) * own.information;
      c += weight(k) * own.gradient;
    }
    covariance = A;
    if (columns > 0) {
      const ScaledCholeskyOf<Covariance> cholesky(A);
      constexpr double open_below = 1e-13;
      determined = cholesky.is_determined(open_below);
      covariance = cholesky.inverse();
      misfit = determined ? cholesky.log_determinant() : not_a_number;
    }
    estimate.noalias() = S::product(covariance, c);
    degrees_of_freedom.resize(m);
    squares.resize(m);
    for (Eigen::Index k = 0; k < m; ++k) {
      const FixedSums<S>& own = responses[static_cast<std::size_t>(k)];
      const OfColumns to_estimate = S::product(own.information, estimate);
      squares(k) =
          weight(k) *
          std::max(own.squares - 2.0 * estimate.dot(own.gradient) + estimate.dot(to_estimate), 0.0);
      degrees_of_freedom(k) =
          own.degrees_of_freedom - weight(k) * covariance.cwiseProduct(own.information).sum();
      misfit += own.degrees_of_freedom * log_variance(k) + squares(k);
    }
  }

  // Towards the least misfit among variances that are not below the lowest.
  // @param is_newton  on return whether it is one of Newton's.
  [[nodiscard]] OfResponses newton_step(const std::vector<FixedSums<S>>& responses,
                                        const OfResponses& lowest,
                                        bool& is_newton) const {
    const auto m = log_variance.size();
    const OfResponses gradient = degrees_of_freedom - squares;
    // Those that stay at their lowest have no step, and no part in that of the others.
    const auto is_open = [&](Eigen::Index k) {
      return log_variance(k) > lowest(k) || gradient(k) < 0.0;
    };
    typename S::Columns gradients(estimate.size(), m);  // P_k^T (y_k - P_k z) / sigma_k^2
    for (Eigen::Index k = 0; k < m; ++k) {
      const FixedSums<S>& own = responses[static_cast<std::size_t>(k)];
      gradients.col(k) = weight(k) * (own.gradient - S::product(own.information, estimate));
    }
    typename S::AmongResponses H = S::AmongResponses::Identity(m, m);
    OfResponses g = OfResponses::Zero(m);
    for (Eigen::Index k = 0; k < m; ++k) {
      if (!is_open(k)) {
        continue;
      }
      const Covariance CA =
          weight(k) * S::product(covariance, responses[static_cast<std::size_t>(k)].information);
      const Covariance CAC = S::product(CA, covariance);
      const OfColumns Cg = S::product(covariance, gradients.col(k));
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
    std::optional<OfResponses> solution = S::solved(H, g);
    is_newton = solution.has_value();
    // Where the likelihood is not convex: what sigma_k^2 = RSS_k / nu_k asks for, at least by its
    // sign.
    const OfResponses step =
        is_newton ? OfResponses(-*solution) : OfResponses(-g.cwiseQuotient(squares.cwiseMax(1.0)));
    constexpr double longest_step = 2.0;
    return step * std::min(1.0, longest_step / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
  }

  bool determined = true;
  OfResponses log_variance;        // u, m
  OfResponses weight;              // 1 / sigma^2, m
  double misfit = 0.0;             // -2 ln of the likelihood, but for a constant
  OfResponses degrees_of_freedom;  // nu, m
  OfResponses squares;             // RSS_k / sigma_k^2, m
  OfColumns estimate;              // z, D
  Covariance covariance;           // how well z is known
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

// @param still_by_newton  a step of Newton's [ln sigma^2] below which no other follows.
template <typename S>
std::optional<AtVariances<S>> least_misfit(const std::vector<FixedSums<S>>& responses,
                                           const typename S::OfResponses& start,
                                           const typename S::OfResponses& smallest,
                                           double still_by_newton) {
  const typename S::OfResponses lowest = smallest.array().log();
  AtVariances<S> best(responses, start.array().log().max(lowest.array()).matrix());
  if (!best.determined) {
    return std::nullopt;
  }
  double readings = 0.0;
  for (const FixedSums<S>& response : responses) {
    readings += response.degrees_of_freedom;
  }
  constexpr int most_rounds = 100;
  for (int round = 0; round < most_rounds; ++round) {
    bool is_newton = false;
    typename S::OfResponses step = best.newton_step(responses, lowest, is_newton);
    bool better = false;
    for (int halving = 0; halving < 30 && !better; ++halving) {
      AtVariances<S> next(responses, (best.log_variance + step).cwiseMax(lowest));
      // Rounding of the likelihood must not stop the last steps.
      better = next.misfit <= best.misfit + 1e-13 * (readings + std::abs(best.misfit));
      if (better) {
        best = std::move(next);
      } else {
        step *= 0.5;
        is_newton = false;
      }
    }
    // What is left after a step of Newton's is about its square.
    const double still = is_newton ? still_by_newton : 1e-13;
    if (!better || step.cwiseAbs().maxCoeff() < still) {
      break;
    }
  }
  return best;
}

// @tparam Fit  what it is said as.
template <typename S, typename Fit, typename Responses>
std::optional<Fit> fit_together(const Responses& given,
                                const typename S::OfResponses& start,
                                const typename S::OfResponses& smallest,
                                double still_by_newton = 1e-8) {
  const std::optional<AtVariances<S>> best = least_misfit<S>(
      std::vector<FixedSums<S>>(given.begin(), given.end()), start, smallest, still_by_newton);
  if (!best) {
    return std::nullopt;
  }
  return Fit{.variance = best->log_variance.array().exp(),
             .degrees_of_freedom = best->degrees_of_freedom,
             .estimate = best->estimate,
             .covariance = best->covariance};
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
  const Eigen::Index columns = responses.front().information.cols();
  if (columns == 2 && responses.size() == 3) {
    return fit_together<SharedDirection, SharedFit>(responses, start, smallest);
  }
  return columns <= few && responses.size() <= few
             ? fit_together<SharedOfFew, SharedFit>(responses, start, smallest)
             : fit_together<SharedOfAny, SharedFit>(responses, start, smallest);
}

std::optional<DirectionFit> fit_shared(const std::array<DirectionSums, 3>& responses,
                                       const Eigen::Vector3d& start,
                                       const Eigen::Vector3d& smallest) {
  return fit_together<SharedDirection, DirectionFit>(responses, start, smallest);
}

std::optional<DirectionFit> fit_shared_roughly(const std::array<DirectionSums, 3>& responses,
                                               const Eigen::Vector3d& start,
                                               const Eigen::Vector3d& smallest) {
  constexpr double nearly_still = 1e-2;
  return fit_together<SharedDirection, DirectionFit>(responses, start, smallest, nearly_still);
}

}  // namespace axiscal
