// SPDX-License-Identifier: Apache-2.0
#include "clear_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "axiscal/calib/variance_components.hpp"
#include "detection.hpp"
#include "mistake_kind.hpp"

namespace axiscal {
namespace {

using Directions = Eigen::Matrix<double, 3, 2>;  // a row for each axis

// How far tests to first order may be from those of a fit: above this many times a level nothing is
// near it.
constexpr double clearly = 1.3;

// What is left of the axes by a run's fit, as HypothesisFit has it.
struct LeftOfRun {
  explicit LeftOfRun(const SmallRun& run)
      : rss(run.residuals().colwise().squaredNorm().transpose()) {
    const auto own = static_cast<double>(run.readings() - 4);
    for (Eigen::Index k = 0; k < 3; ++k) {
      freedom(k) = own - run.shared_basis().middleCols<2>(2 * k).squaredNorm();
    }
  }

  [[nodiscard]] double p_of(double drop, double q) const {
    return nested_f_p(rss.sum(), freedom.sum(), drop, q);
  }

  [[nodiscard]] double equality_p() const {
    return equal_variances_p(rss.cwiseQuotient(freedom), freedom);
  }

  Eigen::Vector3d rss;
  Eigen::Vector3d freedom;
};

// Two numbers of each axis, which are side by side.
Directions by_axis(const Eigen::Matrix<double, 6, 1>& numbers) {
  Directions rows;
  for (Eigen::Index k = 0; k < 3; ++k) {
    rows.row(k) = numbers.segment<2>(2 * k).transpose();
  }
  return rows;
}

// One reading deleted, any of them.
double single_p(const SmallRun& run, const LeftOfRun& left) {
  double largest = 0.0;
  constexpr double least = 1e-9;  // that can be left of a reading
  for (Eigen::Index i = 0; i < run.readings(); ++i) {
    const double own = 1.0 - run.state().basis().row(i).squaredNorm();
    if (!run.has_directions()) {
      largest = std::max(largest, own > least ? run.residuals().row(i).squaredNorm() / own : 0.0);
      continue;
    }
    const Directions shared = by_axis(run.shared_basis().row(i).transpose());
    Eigen::Matrix3d rest = -shared.lazyProduct(shared.transpose());
    rest.diagonal().array() += own;
    largest = std::max(largest, squares_by<Eigen::Matrix3d, Eigen::Vector3d>(
                                    rest, run.residuals().row(i).transpose(), least));
  }
  return static_cast<double>(run.readings()) * left.p_of(largest, 3.0);
}

using Order = std::array<Eigen::Index, SmallState::most_readings>;

// Positions of the readings in the order in which they were taken.
Order order_of(const SmallState& state) {
  Order order{};
  const auto end = order.begin() + state.readings();
  std::iota(order.begin(), end, Eigen::Index{0});
  const auto number = [&](Eigen::Index i) {
    return state.set().readings[static_cast<std::size_t>(i)].run;
  };
  const auto before = [&](Eigen::Index a, Eigen::Index b) { return number(a) < number(b); };
  if (!std::is_sorted(order.begin(), end, before)) {
    std::stable_sort(order.begin(), end, before);
  }
  return order;
}

// A drift of every bias over the run.
double drift_p(const SmallRun& run, const LeftOfRun& left, const Order& order) {
  const Eigen::Index n = run.readings();
  SmallRun::Columns<1> along(n);
  for (Eigen::Index at = 0; at < n; ++at) {
    along(order[static_cast<std::size_t>(at)]) =
        static_cast<double>(at) / static_cast<double>(n - 1) - 0.5;
  }
  const Directions in_shared = by_axis(run.shared_basis().transpose().lazyProduct(along));
  const double squares = along.squaredNorm();
  Eigen::Matrix3d rest = -in_shared.lazyProduct(in_shared.transpose());
  rest.diagonal().array() +=
      squares - run.state().basis().transpose().lazyProduct(along).squaredNorm();
  const Eigen::Vector3d product = run.residuals().transpose().lazyProduct(along);
  return left.p_of(squares_by(rest, product, 1e-9 * squares), 3.0);
}

// The readings at an end of an axis's range shifted; 0 where it is not clear which those are.
double ends_p(const SmallRun& run, const LeftOfRun& left) {
  constexpr double unclear = 1e-3;
  double largest = 0.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const SmallRun::Columns<1> sensed =
        run.state().field_met().lazyProduct(run.state().sensitivity().row(k).transpose());
    for (const double sign : {1.0, -1.0}) {
      const double end = (sign * sensed).maxCoeff();
      Eigen::RowVector4d own = Eigen::RowVector4d::Zero();
      Eigen::RowVector2d shared = Eigen::RowVector2d::Zero();
      double count = 0.0;
      double product = 0.0;
      for (Eigen::Index i = 0; i < run.readings(); ++i) {
        const double beyond = sign * sensed(i) - end_of_range * end;
        if (std::abs(beyond) < unclear * std::abs(end)) {
          return 0.0;
        }
        if (beyond > 0.0) {
          own += run.state().basis().row(i);
          shared += run.shared_basis().row(i).segment<2>(2 * k);
          count += 1.0;
          product += run.residuals()(i, k);
        }
      }
      const double rest = count - own.squaredNorm() - shared.squaredNorm();
      if (rest > 1e-9 * count) {
        largest = std::max(largest, product * product / rest);
      }
    }
  }
  return 6.0 * left.p_of(largest, 1.0);
}

// The table moved behind any reading.
double cuts_p(const SmallRun& run, const LeftOfRun& left, const Order& order) {
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector2d product = Eigen::Vector2d::Zero();
  std::array<Eigen::Matrix<double, 4, 2>, 3> in_own;
  in_own.fill(Eigen::Matrix<double, 4, 2>::Zero());
  Eigen::Matrix2d in_shared = Eigen::Matrix2d::Zero();
  double largest = 0.0;
  for (Eigen::Index at = run.readings() - 1; at > 0; --at) {
    const Eigen::Index i = order[static_cast<std::size_t>(at)];
    Eigen::Matrix2d taken = Eigen::Matrix2d::Zero();
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::RowVector2d z = run.state().tangents().row(i).segment<2>(2 * k) / run.sigma(k);
      squares.noalias() += z.transpose().lazyProduct(z);
      product += run.residuals()(i, k) * z.transpose();
      Eigen::Matrix<double, 4, 2>& own = in_own[static_cast<std::size_t>(k)];
      own.noalias() += run.state().basis().row(i).transpose().lazyProduct(z);
      in_shared.noalias() += run.shared_basis().row(i).segment<2>(2 * k).transpose().lazyProduct(z);
      taken.noalias() += own.transpose().lazyProduct(own);
    }
    taken.noalias() += in_shared.transpose().lazyProduct(in_shared);
    largest =
        std::max(largest, squares_by<Eigen::Matrix2d, Eigen::Vector2d>(
                              squares - taken, product, 1e-9 * squares.diagonal().maxCoeff()));
  }
  return static_cast<double>(run.readings() - 1) * left.p_of(largest, 2.0);
}

// Whether one step led to where HypothesisFitter would end.
bool is_linear(const SmallRun& run) {
  Eigen::RowVector2d lengths = Eigen::RowVector2d::Zero();
  double change = 0.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const SmallRun::Columns<2> own = run.state().tangents().middleCols<2>(2 * k) / run.sigma(k);
    lengths += own.colwise().squaredNorm();
    change += (own * run.step()).squaredNorm();
  }
  lengths = lengths.cwiseSqrt();
  const double left = run.residuals().norm();
  const double turned = run.step().norm();
  constexpr double with_sensitivities = 2.0;  // which change by about as much as the field turns
  return turned < small_turn_rad && left < small_residuals * lengths.minCoeff() &&
         (run.root_of_shared().rowwise().norm().transpose().cwiseProduct(lengths).array() <
          widest_of_linear)
             .all() &&
         with_sensitivities * turned * std::sqrt(change) < nothing * left;
}

}  // namespace

bool looks_clearly_good(const SmallState& state, bool directions) {
  constexpr double far_above_rounding = 10.0;
  const ReadingSet& set = state.set();
  const Eigen::Index n = state.readings();
  const SmallRun plain(state, Eigen::Vector3d::Ones(), directions);
  if (!plain.is_determined() || set.noise_ratio.size() > 0 ||
      n >= SuspectRun::fewest_for_deletion || (directions && !is_linear(plain))) {
    return false;
  }
  const LeftOfRun left(plain);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double rms = std::sqrt(left.rss(k) / static_cast<double>(n));
    if (!(rms > far_above_rounding * set.rounding(k)) ||
        !(clearly * rms <
          large_share * state.sensitivity().row(k).norm() * state.field_magnitude())) {
      return false;
    }
  }
  const Order order = order_of(state);
  const auto is_clear = [](double p) { return classes * p > clearly * worth_a_look; };
  if (!is_clear(single_p(plain, left)) || !is_clear(drift_p(plain, left, order)) ||
      !is_clear(ends_p(plain, left)) || (directions && !is_clear(cuts_p(plain, left, order)))) {
    return false;
  }
  if (left.equality_p() > clearly * may_be_equal) {
    return true;
  }
  // By the axes' own scatter a noisy one hides nothing.
  const SmallRun weighed(state, left.rss.cwiseQuotient(left.freedom.cwiseMax(0.5)).cwiseSqrt(),
                         directions);
  return weighed.is_determined() && (!directions || is_linear(weighed)) &&
         is_clear(single_p(weighed, LeftOfRun(weighed)));
}

}  // namespace axiscal
