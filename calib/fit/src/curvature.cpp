// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/curvature.hpp"

#include "calib/regression/factor.hpp"
#include "calib/regression/variance_components.hpp"

namespace axiscal {

double CurvatureFTest::readings_of(Eigen::Index axis) const {
  return static_cast<double>((layings_.set().weights.col(axis).array() > 0.0).count()) +
         freedom_within_(axis);
}

double CurvatureFTest::taken() const {
  const ReadingSet& set = layings_.set();
  return static_cast<double>(set.column_count()) + 1.0 +
         (directions_ ? 2.0 / static_cast<double>(set.axis_count()) : 0.0);
}

void CurvatureFTest::count_means_if_they_share_errors(
    const Eigen::Ref<const Eigen::VectorXd>& left) {
  const Eigen::Index m = layings_.set().axis_count();
  FisherSum axes;
  for (Eigen::Index k = 0; k < m && !seats_are_fitted(); ++k) {
    const double between = readings_of(k) - freedom_within_(k) - taken();
    if (between > 0.0 && within_(k) > 0.0) {
      axes.add(f_upper_p((left(k) / between) / (within_(k) / freedom_within_(k)), between,
                         freedom_within_(k)));
    }
  }
  constexpr double clearly_more = 0.02;
  if (axes.count() > 0.0 && axes.p_value() < clearly_more) {
    within_.setZero();
    freedom_within_.setZero();
  }
}

bool CurvatureFTest::pool_variances_if_equal(const Eigen::Ref<const Eigen::VectorXd>& left) {
  const ReadingSet& set = layings_.set();
  const Eigen::Index m = set.axis_count();
  if (seats_are_fitted()) {
    return false;  // the residuals contain the errors of the seats
  }
  const Eigen::VectorXd ratio = set.noise_ratio.size() > 0
                                    ? Eigen::VectorXd(set.noise_ratio.cwiseAbs2())
                                    : Eigen::VectorXd(Eigen::VectorXd::Ones(m));
  const Eigen::VectorXd squares = (within_ + left).cwiseQuotient(ratio);
  Eigen::VectorXd free(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    free(k) = readings_of(k) - taken();
  }
  constexpr double contradicted = 0.1;
  const bool alike = set.noise_ratio.size() > 0 ||
                     equal_variances_p(squares.cwiseQuotient(free), free) > contradicted;
  if (!(free.minCoeff() > 1.0) || !alike) {
    return false;
  }
  variances_.head(m) = squares.sum() / free.sum() * ratio;
  return true;
}

std::optional<CurvatureFit> IndependentCurvature::fit(const Eigen::VectorXd& variances,
                                                      bool bent) const {
  const auto m = static_cast<Eigen::Index>(axes_.size());
  const Eigen::Index shared = axes_.front().gradient.size() - 1;
  CurvatureFit bend{.estimate = Eigen::VectorXd::Zero(m), .squares_of_axis = Eigen::VectorXd(m)};
  for (Eigen::Index k = 0; k < m; ++k) {
    bend.squares_of_axis(k) = axes_[static_cast<std::size_t>(k)].squares;
    bend.squares += bend.squares_of_axis(k) / variances(k);
  }
  if (shared == 0 && !bent) {
    return bend;
  }
  Eigen::VectorXd right;
  const std::optional<Eigen::VectorXd> estimate = solved(variances, bent, right);
  if (!estimate) {
    return std::nullopt;
  }
  bend.squares -= estimate->dot(right);
  for (Eigen::Index k = 0; k < m; ++k) {
    const Axis& axis = axes_[static_cast<std::size_t>(k)];
    Eigen::VectorXd own(shared + 1);
    own.head(shared) = estimate->head(shared);
    own(shared) = bent ? (*estimate)(shared + k) : 0.0;
    bend.estimate(k) = own(shared);
    bend.squares_of_axis(k) = std::max(
        axis.squares - 2.0 * own.dot(axis.gradient) + own.dot(axis.information * own), 0.0);
  }
  return bend;
}

// Solves the normal equations. `right` receives their right-hand side.
std::optional<Eigen::VectorXd> IndependentCurvature::solved(const Eigen::VectorXd& variances,
                                                            bool bent,
                                                            Eigen::VectorXd& right) const {
  const auto m = static_cast<Eigen::Index>(axes_.size());
  const Eigen::Index shared = axes_.front().gradient.size() - 1;
  const Eigen::Index size = shared + (bent ? m : 0);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd lengths = Eigen::VectorXd::Zero(size);
  right = Eigen::VectorXd::Zero(size);
  for (Eigen::Index e = shared - errors_; e < shared; ++e) {
    normal(e, e) = 1.0;
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    const Axis& axis = axes_[static_cast<std::size_t>(k)];
    const double weight = 1.0 / variances(k);
    const auto place = [&](Eigen::Index j) { return j < shared ? j : shared + k; };
    for (Eigen::Index j = 0; j < shared + (bent ? 1 : 0); ++j) {
      right(place(j)) += weight * axis.gradient(j);
      lengths(place(j)) += weight * axis.lengths(j);
      for (Eigen::Index i = 0; i < shared + (bent ? 1 : 0); ++i) {
        normal(place(i), place(j)) += weight * axis.information(i, j);
      }
    }
  }
  constexpr double open_below = 1e-13;
  const PositiveFactor cholesky(normal);
  if (!cholesky.is_determined(open_below) ||
      !(normal.diagonal().array() > open_below * lengths.array()).all()) {
    return std::nullopt;
  }
  return cholesky.solve(right);
}

}  // namespace axiscal
