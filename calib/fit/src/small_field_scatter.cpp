// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "axiscal/calib/rough_tails.hpp"
#include "axiscal/calib/small_run.hpp"
#include "noise_parts.hpp"
#include "scatter_components.hpp"

namespace axiscal {
namespace {

// Two parts of a small run's white noise by hat matrices H = K K^T themselves: of weights D the
// trace of (P D P)^2 is that of D^2 - 2 D^2 H + D H D H.
class SmallParts {
 public:
  SmallParts(const SmallRun& run, const Eigen::Matrix3d& sensitivity) : run_(run) {
    const Eigen::Index n = run.readings();
    const SmallState& state = run.state();
    const SmallRun::Columns<3> at = state.field_met() * state.sensitivity().transpose();
    const SmallRun::Columns<3> cosines =
        state.field_met() * sensitivity.rowwise().normalized().transpose();
    along_.resize(n, 3);
    weights_.resize(n, 3);
    shared_along_ = SmallRun::Columns<2>::Zero(n, 2);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double met = std::max(state.field_met().row(i).norm(), least);
      weights_.row(i) = (cosines.row(i) / met).cwiseAbs2();
      for (Eigen::Index k = 0; k < 3; ++k) {
        along_(i, k) = at(i, k) / run.sigma(k);
      }
      along_.row(i) /= std::max(along_.row(i).norm(), least);
    }
    for (Eigen::Index k = 0; k < 3 && run.has_directions(); ++k) {
      shared_along_ += along_.col(k).asDiagonal() * run.shared_basis_of_axis(k);
    }
    own_leverage_ = state.basis().rowwise().squaredNorm();
    deviations_ = along_.cwiseProduct(run.residuals()).rowwise().sum();
    add_pairs();
  }

  // Along the field, and what is left across it.
  [[nodiscard]] bool is_clear(const Gate& gate) const {
    const auto n = static_cast<double>(run_.readings());
    const double taken = along_hat_.trace();
    const double taken_of_square = along_hat_.squaredNorm();
    const PartOfNoise one{.squares = deviations_.squaredNorm(),
                          .trace = n - taken,
                          .trace_of_square = n - 2.0 * taken + taken_of_square};
    const double left = run_.degrees_of_freedom();
    const PartOfNoise other{.squares = run_.residuals().squaredNorm() - one.squares,
                            .trace = left - one.trace,
                            .trace_of_square = left - n + taken_of_square};
    const std::optional<double> above = rough_p(one, other);
    return above && *above > gate.above + near && 1.0 - *above > gate.below + near;
  }

  // Each axis where it lies along the field, and where it lies across it.
  [[nodiscard]] bool is_clear_of_axis(Eigen::Index k, const Gate& gate) const {
    SmallRun::Columns<1> leverage = own_leverage_;
    if (run_.has_directions()) {
      leverage += run_.shared_basis_of_axis(k).rowwise().squaredNorm();
    }
    const auto part_of = [&](const auto& weights, double squares_of_hat) {
      return PartOfNoise{
          .squares = weights.dot(run_.residuals().col(k).cwiseAbs2()),
          .trace = weights.dot((1.0 - leverage.array()).matrix()),
          .trace_of_square =
              weights.cwiseAbs2().dot((1.0 - 2.0 * leverage.array()).matrix()) + squares_of_hat};
    };
    const SmallRun::Columns<1> weights = weights_.col(k);
    const SmallRun::Columns<1> others = 1.0 - weights.array();
    const std::optional<double> above =
        rough_p(part_of(weights, along_squares_(k)), part_of(others, across_squares_(k)));
    return above && *above > gate.above_of_axis + near;
  }

  // Consecutive deviations; as likeness_along() has it, G = K^T A K.
  [[nodiscard]] double likeness() const {
    const Eigen::Index n = run_.readings();
    const Hat& H = along_hat_;
    Hat AH(n, n);
    double trace = 0.0;  // of A H
    double trace_of_A2H = 0.0;
    for (Eigen::Index j = 0; j < n; ++j) {
      AH.col(j).head(n - 1) = 0.5 * H.col(j).tail(n - 1);
      AH(n - 1, j) = 0.0;
      AH.col(j).tail(n - 1) += 0.5 * H.col(j).head(n - 1);
      trace += AH(j, j);
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      trace_of_A2H += (i > 0 ? 0.5 * AH(i - 1, i) : 0.0) + (i + 1 < n ? 0.5 * AH(i + 1, i) : 0.0);
    }
    const auto readings = static_cast<double>(n);
    const double d = readings - H.trace();
    const double c = -trace / d;
    const double variance =
        2.0 * (0.5 * (readings - 1.0) - 2.0 * trace_of_A2H + AH.cwiseProduct(AH.transpose()).sum() -
               2.0 * c * (-2.0 * trace + AH.cwiseProduct(H).sum()) +
               c * c * (readings - 2.0 * H.trace() + H.squaredNorm()));
    const double squares = deviations_.squaredNorm();
    if (!(squares > 0.0) || !(d > 2.0) || !(variance > 0.0)) {
      return 0.0;
    }
    const double products = d * deviations_.head(n - 1).dot(deviations_.tail(n - 1)) / squares;
    return (products + trace) / std::sqrt(variance);
  }

  static constexpr double near = 0.03;  // of the levels

 private:
  using Hat = Eigen::Matrix<double,
                            Eigen::Dynamic,
                            Eigen::Dynamic,
                            Eigen::ColMajor,
                            SmallState::most_readings,
                            SmallState::most_readings>;
  static constexpr double least = std::numeric_limits<double>::min();

  // Of each two readings the entries of the hat matrices, of which sums are kept.
  void add_pairs() {
    const Eigen::Index n = run_.readings();
    along_hat_.resize(n, n);
    const SmallRun::Columns<6>& B = run_.shared_basis();
    const SmallRun::Columns<4>& Q = run_.state().basis();
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::RowVector4d own = Q.row(i);
      const Eigen::Matrix<double, 1, 6> shared = B.row(i);
      const Eigen::RowVector3d along = along_.row(i);
      const Eigen::RowVector3d weight = weights_.row(i);
      for (Eigen::Index j = 0; j <= i; ++j) {
        const double counts = i == j ? 1.0 : 2.0;
        const double by_own = own.dot(Q.row(j));
        along_hat_(i, j) = along.dot(along_.row(j)) * by_own;
        Eigen::Vector3d hat = Eigen::Vector3d::Constant(by_own);
        if (run_.has_directions()) {
          along_hat_(i, j) += shared_along_.row(i).dot(shared_along_.row(j));
          for (Eigen::Index k = 0; k < 3; ++k) {
            hat(k) += shared.segment<2>(2 * k).dot(B.row(j).segment<2>(2 * k));
          }
        }
        along_hat_(j, i) = along_hat_(i, j);
        for (Eigen::Index k = 0; k < 3; ++k) {
          const double square = counts * hat(k) * hat(k);
          along_squares_(k) += weight(k) * weights_(j, k) * square;
          across_squares_(k) += (1.0 - weight(k)) * (1.0 - weights_(j, k)) * square;
        }
      }
    }
  }

  // That the one is so much larger than the other by chance; nothing where that is not clear.
  static std::optional<double> rough_p(const PartOfNoise& one, const PartOfNoise& other) {
    constexpr double enough = 2.0;
    if (!(one.trace > enough) || !(other.trace > enough) || !(other.squares > 0.0) ||
        !(one.freedom() > enough) || !(other.freedom() > enough)) {
      return std::nullopt;
    }
    return f_upper_p_roughly((one.squares / one.trace) / (other.squares / other.trace),
                             one.freedom(), other.freedom());
  }

  const SmallRun& run_;
  SmallRun::Columns<3> along_;         // the unit vector along the field
  SmallRun::Columns<3> weights_;       // of an axis's readings, for the part along the field
  SmallRun::Columns<2> shared_along_;  // what the fit takes of that direction by its directions
  SmallRun::Columns<1> own_leverage_;  // of an axis's own columns
  SmallRun::Columns<1> deviations_;    // of the residuals, along the field
  Hat along_hat_;                      // of them
  Eigen::Vector3d along_squares_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d across_squares_ = Eigen::Vector3d::Zero();
};

}  // namespace

bool has_clearly_no_field_scatter(const SmallState& state, const Estimate& estimate) {
  const std::vector<ScatterComponent>& known = estimate.statistics.components;
  const bool seats_fitted = std::any_of(
      known.begin(), known.end(), [](const auto& component) { return component.name == "seats"; });
  Eigen::Vector3d sigma = estimate.statistics.residual_sd;
  for (Eigen::Index k = 0; k < 3; ++k) {
    constexpr double far_above = 10.0;
    if (!(sigma(k) > far_above * state.set().rounding(k))) {
      return false;
    }
  }
  const SmallRun run(state, sigma, state.has_directions());
  if (seats_fitted || !run.is_determined() || state.readings() < fewest_looked_at) {
    return false;
  }
  const SmallParts parts(run, Eigen::Matrix3d(estimate.response.sensitivity));
  const Gate gate(state.readings());
  return parts.is_clear(gate) && parts.is_clear_of_axis(0, gate) &&
         parts.is_clear_of_axis(1, gate) && parts.is_clear_of_axis(2, gate) &&
         parts.likeness() < one_sided_5_percent - SmallParts::near;
}

}  // namespace axiscal
