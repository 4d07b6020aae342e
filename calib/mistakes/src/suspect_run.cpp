// SPDX-License-Identifier: Apache-2.0
#include "calib/mistakes/src/suspect_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace axiscal {

std::vector<std::size_t> first_of(const std::vector<std::size_t>& order, std::size_t count) {
  return {order.begin(),
          order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()))};
}

SuspectRun::SuspectRun(const ReadingSet& set, const Estimate& estimate, bool known_field)
    : set_(set),
      estimate_(estimate),
      fitter_(estimate.field,
              known_field,
              set.noise_ratio.size() > 0
                  ? set.noise_ratio
                  : Eigen::VectorXd(Eigen::VectorXd::Ones(set.axis_count()))),
      stated_ratio_(set.noise_ratio.size() > 0),
      order_(order_of_runs(set.readings)),
      plain_(fitter_.fit(set)) {}

void SuspectRun::fit_single_deletions() {
  deletions_.assign(count(), {});
  by_deletion_.resize(count());
  std::iota(by_deletion_.begin(), by_deletion_.end(), std::size_t{0});
  std::vector<double> left(count());  // the sum of squares without each reading
  std::vector<std::size_t> fitted = by_deletion_;
  const auto sort_by_left = [&](std::vector<std::size_t>& readings) {
    std::stable_sort(readings.begin(), readings.end(),
                     [&](std::size_t a, std::size_t b) { return left[a] < left[b]; });
  };
  if (count() > each_is_fitted) {
    for (std::size_t i = 0; i < count(); ++i) {
      left[i] = plain_.total() - rss_drop_without_readings(plain_, {&i, 1});
    }
    sort_by_left(fitted);
    fitted.resize(max_candidate_fits());
  }
  for (const std::size_t i : fitted) {
    deletions_[i] = fitter_.fit(set_, {i});
    deletions_[i].forget_readings();
    left[i] =
        deletions_[i].fitted ? deletions_[i].total() : std::numeric_limits<double>::infinity();
  }
  // The readings whose deletion was not fitted come last.
  sort_by_left(fitted);
  std::vector<bool> is_fitted(count(), false);
  for (const std::size_t i : fitted) {
    is_fitted[i] = true;
  }
  std::erase_if(by_deletion_, [&](std::size_t i) { return is_fitted[i]; });
  by_deletion_.insert(by_deletion_.begin(), fitted.begin(), fitted.end());
}

void SuspectRun::fit_pair_deletions() {
  constexpr std::size_t most = 14;
  const std::size_t few = std::min(most, count() > each_is_fitted ? max_candidate_fits() : most);
  std::vector<std::size_t> candidates = by_deletion_;
  if (candidates.size() > few) {
    const std::vector<std::size_t> large = largest_residuals(few / 2);
    candidates.resize(few / 2);
    for (const std::size_t i : large) {
      if (std::find(candidates.begin(), candidates.end(), i) == candidates.end()) {
        candidates.push_back(i);
      }
    }
  }
  best_pair_ = {};
  for (const ReadingPair& pair : pairs_to_fit(candidates)) {
    HypothesisFit fit = fitter_.fit(set_, {pair.begin(), pair.end()});
    fit.forget_readings();
    if (fit.fitted && (!best_pair_.fitted || fit.total() < best_pair_.total())) {
      best_pair_ = std::move(fit);
      pair_ = pair;
    }
  }
}

std::vector<ReadingPair> SuspectRun::pairs_to_fit(
    const std::vector<std::size_t>& candidates) const {
  std::vector<std::pair<double, ReadingPair>> ranked;  // with the decrease of the sum of squares
  for (std::size_t a = 0; a < candidates.size(); ++a) {
    for (std::size_t b = a + 1; b < candidates.size(); ++b) {
      const ReadingPair pair = {candidates[a], candidates[b]};
      ranked.emplace_back(rss_drop_without_readings(plain_, pair), pair);
    }
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  constexpr std::size_t most = 12;
  ranked.resize(std::min(most, ranked.size()));
  std::vector<ReadingPair> pairs;
  for (const auto& [drop, pair] : ranked) {
    pairs.push_back(pair);
  }
  return pairs;
}

void SuspectRun::weigh_axes_by(const HypothesisFit& clean) {
  const Eigen::VectorXd own =
      (clean.rss.array() / clean.degrees_of_freedom.array().max(0.5)).sqrt();
  fitter_ = HypothesisFitter(clean.field, fitter_.known_field(),
                             fitter_.scale().cwiseProduct(own / own.maxCoeff()));
  plain_ = fitter_.fit(set_);
  if (plain_.fitted) {
    fit_single_deletions();
    fit_pair_deletions();
  }
}

bool SuspectRun::only_rounding() const {
  for (Eigen::Index k = 0; k < m(); ++k) {
    if (plain_.rss(k) > 4.0 * std::pow(set_.rounding(k), 2) * static_cast<double>(n())) {
      return false;
    }
  }
  return true;
}

std::vector<std::size_t> SuspectRun::largest_residuals(std::size_t most) const {
  std::vector<std::size_t> all(count());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const Eigen::VectorXd size = plain_.residuals.rowwise().squaredNorm();
  std::stable_sort(all.begin(), all.end(), [&](std::size_t a, std::size_t b) {
    return size(static_cast<Eigen::Index>(a)) > size(static_cast<Eigen::Index>(b));
  });
  return first_of(all, most);
}

// Returns the indices of these readings' rows in a matrix of n m rows. The rows of axis 0 come
// first, then those of axis 1, and so on.
std::vector<Eigen::Index> SuspectRun::rows_of(const std::vector<std::size_t>& readings) const {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < m(); ++k) {
    for (const std::size_t i : readings) {
      rows.push_back(n() * k + static_cast<Eigen::Index>(i));
    }
  }
  return rows;
}

namespace {

// Returns the decrease of the sum of squares if readings are deleted. It is e^T (1 - H)^-1 e, where
// e contains the residuals of these readings and H is their part of the hat matrix.
// @tparam Count  the number of rows, if it is known at compile time.
// @tparam Most   the largest possible number of rows; a small number avoids heap memory.
template <int Count, int Most>
double drop_of_rows(const HypothesisFit& fit,
                    std::span<const std::size_t> readings,
                    Eigen::Index m) {
  const auto d = static_cast<Eigen::Index>(readings.size());
  Eigen::Matrix<double, Count, Count, 0, Most, Most> M(d * m, d * m);
  Eigen::Matrix<double, Count, 1, 0, Most, 1> e(d * m);
  for (Eigen::Index a = 0; a < d * m; ++a) {
    const auto i = static_cast<Eigen::Index>(readings[static_cast<std::size_t>(a / m)]);
    e(a) = fit.residuals(i, a % m);
    for (Eigen::Index b = 0; b <= a; ++b) {
      const auto j = static_cast<Eigen::Index>(readings[static_cast<std::size_t>(b / m)]);
      M(a, b) = (a == b ? 1.0 : 0.0) - fit.fit->hat(a % m, i, b % m, j);
    }
  }
  // A pivot is 0 if only a deleted reading determines a coefficient. The residual of this reading
  // then contains no information, and the result is 0.
  return squares_by(M, e, 1e-9);
}

}  // namespace

double SuspectRun::rss_drop_without_readings(const HypothesisFit& fit,
                                             std::span<const std::size_t> readings) const {
  constexpr int of_triad = 3;
  constexpr int few = 6;
  const Eigen::Index rows = static_cast<Eigen::Index>(readings.size()) * m();
  if (rows == of_triad) {
    return drop_of_rows<of_triad, of_triad>(fit, readings, m());
  }
  return rows <= few ? drop_of_rows<Eigen::Dynamic, few>(fit, readings, m())
                     : drop_of_rows<Eigen::Dynamic, Eigen::Dynamic>(fit, readings, m());
}

// Uses the residuals without a projection, because they are orthogonal to the basis of the fit.
double SuspectRun::rss_drop_with_columns(const HypothesisFit& fit, Eigen::MatrixXd Z) const {
  for (Eigen::Index k = 0; k < m(); ++k) {
    Z.middleRows(n() * k, n()).array().colwise() *=
        set_.weights.col(k).array().sqrt() / fitter_.scale()(k);
  }
  const Eigen::MatrixXd in_basis = fit.fit->in_basis(Z);
  const Eigen::MatrixXd left = Z.transpose() * Z - in_basis.transpose() * in_basis;
  const Eigen::VectorXd c = Z.transpose() * fit.residuals.reshaped().matrix();
  return squares_by(left, c, 1e-9 * Z.colwise().squaredNorm().maxCoeff());
}

// Returns the result of rss_drop_with_columns() for one column that is 1 for these readings of one
// axis, and 0 otherwise.
double SuspectRun::rss_drop_with_shift(const HypothesisFit& fit,
                                       Eigen::Index axis,
                                       const std::vector<std::size_t>& readings) const {
  Eigen::MatrixXd in_basis = Eigen::MatrixXd::Zero(fit.fit->column_count(), 1);
  double squares = 0.0;
  double product = 0.0;
  for (const std::size_t i : readings) {
    const auto row = static_cast<Eigen::Index>(i);
    const double z = std::sqrt(set_.weights(row, axis)) / fitter_.scale()(axis);
    fit.fit->add_in_basis(axis, row, Eigen::Matrix<double, 1, 1>(z), in_basis);
    squares += z * z;
    product += z * fit.residuals(row, axis);
  }
  const double left = squares - in_basis.squaredNorm();
  return left > 1e-9 * squares ? product * product / left : 0.0;
}

HypothesisFit SuspectRun::arbitrary(const std::vector<std::size_t>& readings,
                                    std::optional<Eigen::Index> axis) const {
  std::vector<Eigen::Index> rows = rows_of(readings);
  if (axis) {
    rows = {n() * *axis + static_cast<Eigen::Index>(readings.front())};
  }
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), static_cast<Eigen::Index>(rows.size()));
  for (std::size_t j = 0; j < rows.size(); ++j) {
    Z(rows[j], static_cast<Eigen::Index>(j)) = 1.0;
  }
  return fitter_.fit(set_, {}, [&](const auto&, const auto&) { return Z; });
}

}  // namespace axiscal
