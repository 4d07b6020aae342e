// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/linearised_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/minimum_norm.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/scaled_cholesky.hpp"

namespace axiscal {
namespace {

// (J^T J)^-1; empty where the columns depend on each other.
Eigen::MatrixXd inverse_information(const Eigen::MatrixXd& J) {
  const ScaledCholesky cholesky(J.transpose() * J);
  constexpr double dependent = 1e-12;
  return cholesky.is_determined(dependent) ? cholesky.inverse() : Eigen::MatrixXd();
}

Eigen::VectorXd scatter_of(const ReadingSet& set, const Estimate& estimate) {
  Eigen::VectorXd sigma = estimate.statistics.residual_sd;
  for (Eigen::Index k = 0; k < sigma.size(); ++k) {
    sigma(k) = std::max({sigma(k), set.rounding(k), std::numeric_limits<double>::min()});
  }
  return sigma;
}

}  // namespace

LinearisedRun::LinearisedRun(const ReadingSet& set,
                             const JointState& state,
                             Eigen::VectorXd sigma,
                             bool known_field)
    : set_(set), sigma_(std::move(sigma)), sensitivity_(set.axis_count(), 3) {
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  const Eigen::Index p = set.column_count();
  const Eigen::Index D = known_field || !state.field.has_vectors() ? 0 : state.direction_count();
  J_ = Eigen::MatrixXd::Zero(n * m, p * m + D);
  r_.resize(n * m);
  x_ = Eigen::VectorXd::Zero(p * m + D);
  along_.resize(n, m);
  for (std::size_t s = 0; D > 0 && s < state.field.size(); ++s) {
    directions_.push_back(state.tangents[s].cols());
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    const auto rows = rows_of_axis(k);
    const Eigen::VectorXd root = axis.root_weights / sigma_(k);
    J_(rows, Eigen::seqN(p * k, p)) = root.asDiagonal() * axis.X;
    J_(rows, Eigen::seqN(p * m, D)) = axis.tangents.leftCols(D) / sigma_(k);
    r_(rows) = axis.residuals / sigma_(k);
    x_.segment(p * k, p) = axis.estimate;
    sensitivity_.row(k) = axis.estimate.segment<3>(1).transpose();
    along_.col(k) = root.cwiseProduct(axis.X.middleCols<3>(1) * sensitivity_.row(k).transpose());
    rows_ += static_cast<double>((root.array() > 0.0).count());
    designs_.push_back(axis.X);
  }
  C_ = inverse_information(J_);
  if (C_.size() > 0) {
    const Eigen::VectorXd step = taken_up(r_);  // by the axes' own scatter
    r_ -= J_ * step;
    x_ += step;
  }
}

LinearisedRun::LinearisedRun(const ReadingSet& set,
                             const TableField& field,
                             Eigen::VectorXd sigma,
                             bool known_field)
    : LinearisedRun(set, JointFit(set, set.weights).at(field), std::move(sigma), known_field) {}

LinearisedRun::LinearisedRun(const ReadingSet& set, const Estimate& estimate, bool known_field)
    : LinearisedRun(set, estimate.field, scatter_of(set, estimate), known_field) {}

Eigen::MatrixXd LinearisedRun::taken_up(const Eigen::MatrixXd& changes) const {
  if (C_.size() > 0) {
    return C_ * (J_.transpose() * changes);
  }
  // What depends on something else nearly takes up the least that will do.
  const Eigen::VectorXd per_length =
      J_.colwise().norm().cwiseMax(std::numeric_limits<double>::min()).cwiseInverse();
  return per_length.asDiagonal() * (pseudo_inverse(J_ * per_length.asDiagonal()) * changes);
}

std::vector<std::string> LinearisedRun::names() const {
  std::vector<std::string> names;
  for (Eigen::Index k = 0; k < axes(); ++k) {
    const std::vector<std::string> own = set_.names_of_axis(k);
    names.insert(names.end(), own.begin(), own.end());
  }
  for (std::size_t s = 0; s < directions_.size(); ++s) {
    const std::string what =
        set_.field.has_free_length(s) ? "direction and size of " : "direction of ";
    names.insert(names.end(), static_cast<std::size_t>(directions_[s]),
                 what + set_.field.name_of(s));
  }
  return names;
}

Eigen::RowVector3d LinearisedRun::change_with_field(Eigen::Index reading, Eigen::Index axis) const {
  return std::sqrt(set_.weights(reading, axis)) / sigma_(axis) * set_.scale(reading, axis) *
         sensitivity_.row(axis);
}

Eigen::Matrix<double, Eigen::Dynamic, 3> LinearisedRun::field_met(Eigen::Index axis) const {
  return designs_[static_cast<std::size_t>(axis)].middleCols<3>(1);
}

Eigen::MatrixXd LinearisedRun::own_columns(Eigen::Index axis) const {
  const Eigen::VectorXd scale =
      sigma_(axis) * set_.weights.col(axis).cwiseSqrt().cwiseMax(1e-150).cwiseInverse();
  const Eigen::Index c = set_.coefficient_count();
  Eigen::MatrixXd own(readings(), c + shared());
  own << designs_[static_cast<std::size_t>(axis)].leftCols(c),
      scale.asDiagonal() * J_(rows_of_axis(axis), Eigen::lastN(shared()));
  return own;
}

LinearisedRun::AxisRows LinearisedRun::rows_of(Eigen::Index axis) const {
  AxisRows rows;
  for (Eigen::Index i = 0; i < set_.size(); ++i) {
    if (set_.weights(i, axis) > 0.0) {
      rows.readings.push_back(i);
    }
  }
  rows.design = designs_[static_cast<std::size_t>(axis)](rows.readings,
                                                         Eigen::seqN(0, set_.coefficient_count()));
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
  // A variance that is smaller than the readings' own has come so by chance.
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
