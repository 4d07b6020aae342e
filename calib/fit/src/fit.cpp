// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

Eigen::VectorXd scatter_of(const ReadingSet& set, const Estimate& estimate) {
  Eigen::VectorXd sigma = estimate.statistics.residual_sd;
  for (Eigen::Index k = 0; k < sigma.size(); ++k) {
    sigma(k) = std::max({sigma(k), set.rounding(k), std::numeric_limits<double>::min()});
  }
  return sigma;
}

// Returns a matrix with one row for each reading. Row i is a weighted sum of the rows that the axes
// have for reading i; the weight of axis k is by(i, k).
// @param columns_of  function that returns an axis's own columns, then the shared columns, n x (p +
//                    s).
template <typename ColumnsOf>
Eigen::MatrixXd combined(const Fit& run, const Eigen::MatrixXd& by, const ColumnsOf& columns_of) {
  Eigen::MatrixXd all(run.readings(), run.column_count());
  auto shared = all.rightCols(run.shared());
  shared.setZero();
  for (Eigen::Index k = 0; k < run.axes(); ++k) {
    const Eigen::MatrixXd columns = by.col(k).asDiagonal() * columns_of(k);
    const Eigen::Index own = columns.cols() - run.shared();
    all.middleCols(run.column_of(k, 0), own) = columns.leftCols(own);
    shared += columns.rightCols(run.shared());
  }
  return all;
}

}  // namespace

Fit::Fit(const ReadingSet& set, std::shared_ptr<const Solution> solution, Eigen::VectorXd sigma)
    : set_(set),
      solution_(std::move(solution)),
      sigma_(std::move(sigma)),
      sensitivity_(set.axis_count(), 3),
      r_(set.size() * set.axis_count()),
      along_(set.size(), set.axis_count()) {
  const Eigen::Index m = set.axis_count();
  const Eigen::Index p = set.column_count();
  const Eigen::Index D = solution_->shared_count();
  x_ = Eigen::VectorXd::Zero(p * m + D);
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisSolution& axis = axis_of(k);
    r_(rows_of_axis(k)) = axis.residuals / sigma_(k);
    x_.segment(p * k, p) = axis.estimate;
    sensitivity_.row(k) = axis.estimate.segment<3>(1).transpose();
    along_.col(k) = axis.root_weights().cwiseProduct(axis.X().middleCols<3>(1) *
                                                     sensitivity_.row(k).transpose()) /
                    sigma_(k);
    rows_ += static_cast<double>(axis.design->observations());
  }
  find_root_of_shared();
  if (!has_full_rank_ || D == 0) {
    return;
  }
  // The step of the shared unknowns for these sigma, and the resulting change of the coefficients.
  const Eigen::VectorXd gradient = solution_->sums.gradient * sigma_.cwiseAbs2().cwiseInverse();
  const Eigen::VectorXd step = root_of_shared_ * (root_of_shared_.transpose() * gradient);
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisSolution& axis = axis_of(k);
    r_(rows_of_axis(k)) -= axis.projected * step / sigma_(k);
    x_.segment(p * k, p) -= axis.take_up * step;
  }
  x_.tail(D) = step;
}

Fit::Fit(const SolvedReadings& run, const TableField& field, Eigen::VectorXd sigma)
    : Fit(run.set(), run.at(field), std::move(sigma)) {}

Fit::Fit(const SolvedReadings& run, const Estimate& estimate)
    : Fit(run, estimate.field, scatter_of(run.set(), estimate)) {}

// Computes a root R of the covariance Z = R R^T of the shared unknowns. The coefficients of axis k
// have the covariance sigma_k^2 T_k T_k^T + U_k Z U_k^T. T_k is the result of root_of_covariance()
// for the axis's design, and U_k is its matrix `take_up`.
void Fit::find_root_of_shared() {
  const Eigen::Index D = shared();
  // Limit for the fraction of a column's squared norm that is independent of the other columns.
  constexpr double dependent = 1e-12;
  for (Eigen::Index k = 0; k < axes(); ++k) {
    if (!(std::pow(axis_of(k).design->smallest_pivot(), 2) > dependent)) {
      return;
    }
  }
  if (D > 0) {
    const Eigen::VectorXd weights = sigma_.cwiseAbs2().cwiseInverse();
    const Eigen::MatrixXd information = solution_->sums.information_at(weights);
    const Eigen::VectorXd squares = solution_->shared_squares * weights;
    const PositiveFactor cholesky(information);
    if (!cholesky.is_determined(dependent) ||
        !(information.diagonal().array() > dependent * squares.array()).all()) {
      return;
    }
    root_of_shared_ = cholesky.root_of_inverse();
  }
  for (Eigen::Index k = 0; k < axes(); ++k) {
    shared_basis_.push_back(
        D > 0 ? Eigen::MatrixXd(axis_of(k).projected * (root_of_shared_ / sigma_(k)))
              : Eigen::MatrixXd(readings(), 0));
  }
  has_full_rank_ = true;
}

Eigen::MatrixXd Fit::columns_of_axis(Eigen::Index axis) const {
  const AxisSolution& own = axis_of(axis);
  const Eigen::Index p = own.X().cols();
  Eigen::MatrixXd J(readings(), p + shared());
  J.leftCols(p) = (own.root_weights() / sigma_(axis)).asDiagonal() * own.X();
  J.rightCols(shared()) = shared_columns_of_axis(axis);
  return J;
}

Eigen::MatrixXd Fit::shared_columns_of_axis(Eigen::Index axis) const {
  return axis_of(axis).shared / sigma_(axis);
}

double Fit::hat(Eigen::Index axis,
                Eigen::Index reading,
                Eigen::Index other_axis,
                Eigen::Index other_reading) const {
  const Eigen::MatrixXd& P = shared_basis_of_axis(axis);
  double entry = P.row(reading).dot(shared_basis_of_axis(other_axis).row(other_reading));
  if (axis == other_axis) {
    const Eigen::MatrixXd& Q = basis_of_axis(axis);
    entry += Q.row(reading).dot(Q.row(other_reading));
  }
  return entry;
}

Eigen::MatrixXd Fit::leverage() const {
  Eigen::MatrixXd leverage(readings(), axes());
  for (Eigen::Index k = 0; k < axes(); ++k) {
    leverage.col(k) =
        basis_of_axis(k).rowwise().squaredNorm() + shared_basis_of_axis(k).rowwise().squaredNorm();
  }
  return leverage;
}

Eigen::MatrixXd Fit::in_basis(const Eigen::MatrixXd& Z) const {
  const Eigen::Index n = readings();
  const Eigen::Index p = set_.column_count();
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(column_count(), Z.cols());
  for (Eigen::Index k = 0; k < axes(); ++k) {
    products.middleRows(p * k, p) = basis_of_axis(k).transpose() * Z.middleRows(n * k, n);
    products.bottomRows(shared()) += shared_basis_of_axis(k).transpose() * Z.middleRows(n * k, n);
  }
  return products;
}

void Fit::add_in_basis(Eigen::Index axis,
                       Eigen::Index reading,
                       const Eigen::Ref<const Eigen::RowVectorXd>& z,
                       Eigen::MatrixXd& products) const {
  const Eigen::Index p = set_.column_count();
  products.middleRows(p * axis, p).noalias() +=
      basis_of_axis(axis).row(reading).transpose().lazyProduct(z);
  products.bottomRows(shared()).noalias() +=
      shared_basis_of_axis(axis).row(reading).transpose().lazyProduct(z);
}

double Fit::degrees_of_freedom_of(Eigen::Index axis) const {
  const SharedSums& sums = solution_->sums;
  return sums.degrees_of_freedom(axis) -
         sums.information_of(axis).cwiseProduct(covariance_of_shared()).sum() /
             (sigma_(axis) * sigma_(axis));
}

Eigen::MatrixXd Fit::covariance_of_shared() const {
  return root_of_shared_ * root_of_shared_.transpose();
}

Eigen::MatrixXd Fit::combined_columns(const Eigen::MatrixXd& by) const {
  return combined(*this, by, [&](Eigen::Index k) { return columns_of_axis(k); });
}

Eigen::MatrixXd Fit::combined_basis(const Eigen::MatrixXd& by) const {
  return combined(*this, by, [&](Eigen::Index k) {
    const Eigen::MatrixXd& Q = basis_of_axis(k);
    Eigen::MatrixXd both(readings(), Q.cols() + shared());
    both << Q, shared_basis_of_axis(k);
    return both;
  });
}

Fit::RootOfAxis Fit::root_of_axis(Eigen::Index axis) const {
  const AxisSolution& own = axis_of(axis);
  RootOfAxis root{.own = sigma_(axis) * own.design->root_of_covariance(),
                  .shared = Eigen::MatrixXd(own.X().cols(), shared())};
  if (shared() > 0) {
    root.shared = -own.take_up * root_of_shared_;
  }
  return root;
}

Eigen::MatrixXd Fit::orthogonal_to_own_columns(Eigen::Index axis,
                                               const Eigen::MatrixXd& columns) const {
  const Eigen::MatrixXd& Q = basis_of_axis(axis);
  return columns - Q * (Q.transpose() * columns);
}

Eigen::MatrixXd Fit::columns() const {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(row_count(), column_count());
  for (Eigen::Index k = 0; k < axes(); ++k) {
    const Eigen::MatrixXd own = columns_of_axis(k);
    const Eigen::Index p = set_.column_count();
    J(rows_of_axis(k), Eigen::seqN(p * k, p)) = own.leftCols(p);
    J(rows_of_axis(k), Eigen::lastN(shared())) = own.rightCols(shared());
  }
  return J;
}

Eigen::MatrixXd Fit::information() const {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(column_count(), column_count());
  const Eigen::Index p = set_.column_count();
  const Eigen::Index D = shared();
  for (Eigen::Index k = 0; k < axes(); ++k) {
    const Eigen::MatrixXd J = columns_of_axis(k);
    const Eigen::MatrixXd own = J.transpose() * J;
    sum.block(p * k, p * k, p, p) = own.topLeftCorner(p, p);
    sum.block(p * k, first_shared(), p, D) = own.topRightCorner(p, D);
    sum.block(first_shared(), p * k, D, p) = own.bottomLeftCorner(D, p);
    sum.bottomRightCorner(D, D) += own.bottomRightCorner(D, D);
  }
  return sum;
}

Eigen::MatrixXd Fit::solution_change(const Eigen::MatrixXd& changes) const {
  if (has_full_rank_) {  // x = R K^T changes; R: root of the covariance; K: basis of the columns
    Eigen::MatrixXd x(column_count(), changes.cols());
    Eigen::MatrixXd in_shared = Eigen::MatrixXd::Zero(shared(), changes.cols());
    for (Eigen::Index k = 0; k < axes(); ++k) {
      const Eigen::MatrixXd of_axis = changes(rows_of_axis(k), Eigen::all);
      const Eigen::Index p = set_.column_count();
      x.middleRows(p * k, p) = basis_of_axis(k).transpose() * of_axis;
      in_shared += shared_basis_of_axis(k).transpose() * of_axis;
    }
    for (Eigen::Index k = 0; k < axes(); ++k) {
      auto of_axis = x.middleRows(set_.column_count() * k, set_.column_count());
      const RootOfAxis root = root_of_axis(k);
      of_axis = root.own * of_axis + root.shared * in_shared;
    }
    x.bottomRows(shared()) = root_of_shared_ * in_shared;
    return x;
  }
  // If columns are dependent, the result is the change of smallest norm.
  const Eigen::MatrixXd J = columns();
  const Eigen::VectorXd per_length =
      J.colwise().norm().cwiseMax(std::numeric_limits<double>::min()).cwiseInverse();
  return per_length.asDiagonal() * (pseudo_inverse(J * per_length.asDiagonal()) * changes);
}

std::vector<std::string> Fit::names() const {
  std::vector<std::string> names;
  for (Eigen::Index k = 0; k < axes(); ++k) {
    const std::vector<std::string> own = set_.names_of_axis(k);
    names.insert(names.end(), own.begin(), own.end());
  }
  for (std::size_t s = 0; s < solution_->tangents.size(); ++s) {
    const std::string unknown =
        set_.field.has_free_length(s) ? "direction and size of " : "direction of ";
    names.insert(names.end(), static_cast<std::size_t>(solution_->tangents[s].cols()),
                 unknown + set_.field.name_of(s));
  }
  return names;
}

Eigen::RowVector3d Fit::change_with_field(Eigen::Index reading, Eigen::Index axis) const {
  return std::sqrt(set_.weights(reading, axis)) / sigma_(axis) * set_.scale(reading, axis) *
         sensitivity_.row(axis);
}

Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3>> Fit::field_met(Eigen::Index axis) const {
  return axis_of(axis).X().middleCols<3>(1);
}

Eigen::MatrixXd Fit::own_columns(Eigen::Index axis) const {
  const Eigen::VectorXd scale =
      sigma_(axis) * set_.weights.col(axis).cwiseSqrt().cwiseMax(1e-150).cwiseInverse();
  const Eigen::Index c = set_.coefficient_count();
  Eigen::MatrixXd own(readings(), c + shared());
  own << axis_of(axis).X().leftCols(c), scale.asDiagonal() * shared_columns_of_axis(axis);
  return own;
}

Fit::AxisRows Fit::rows_of(Eigen::Index axis) const {
  AxisRows rows;
  for (Eigen::Index i = 0; i < set_.size(); ++i) {
    if (set_.weights(i, axis) > 0.0) {
      rows.readings.push_back(i);
    }
  }
  rows.design = axis_of(axis).X()(rows.readings, Eigen::seqN(0, set_.coefficient_count()));
  rows.response = set_.response(rows.readings, axis);
  rows.weights = set_.weights(rows.readings, axis);
  return rows;
}

WiderIntervals::WiderIntervals(std::string name, Estimate& estimate)
    : estimate_(estimate),
      component_{.name = std::move(name),
                 .sd = Eigen::VectorXd::Zero(estimate.response.bias.size()),
                 .unit = {},
                 .covariance = Eigen::MatrixXd::Zero(estimate.statistics.covariance.rows(),
                                                     estimate.statistics.covariance.cols()),
                 .degrees_of_freedom = std::numeric_limits<double>::infinity()} {}

void WiderIntervals::widen(Eigen::Index parameter, double variance, double degrees_of_freedom) {
  FitStatistics& statistics = estimate_.statistics;
  const double interval = student_t_factor(0.95, degrees_of_freedom) * std::sqrt(variance);
  if (!(interval > statistics.interval_95(parameter))) {
    return;
  }
  statistics.interval_95(parameter) = interval;
  // If the given variance is smaller than the present one, the difference is regarded as chance,
  // and the covariance does not change.
  const double more = std::max(variance - statistics.covariance(parameter, parameter), 0.0);
  statistics.covariance(parameter, parameter) += more;
  component_.covariance(parameter, parameter) += more;
  component_.degrees_of_freedom = std::min(component_.degrees_of_freedom, degrees_of_freedom);
  statistics.interval_dof(parameter) =
      freedom_of_factor(interval / std::sqrt(statistics.covariance(parameter, parameter)), 0.95);
  counts_ = counts_ || more > 0.0;
}

bool WiderIntervals::put() {
  if (counts_) {
    estimate_.statistics.components.push_back(std::move(component_));
  }
  return counts_;
}

}  // namespace axiscal
