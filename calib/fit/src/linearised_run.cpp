// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/linearised_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/joint_fit.hpp"
#include "axiscal/calib/parameter_names.hpp"

namespace axiscal {
namespace {

// (J^T J)^-1 by columns of length 1; empty where they depend on each other.
Eigen::MatrixXd inverse_information(const Eigen::MatrixXd& J) {
  const Eigen::VectorXd length = J.colwise().norm();
  if (!(length.minCoeff() > 0.0)) {
    return {};
  }
  const Eigen::VectorXd scale = length.cwiseInverse();
  const Eigen::MatrixXd N = scale.asDiagonal() * (J.transpose() * J) * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(N);
  constexpr double dependent = 1e-12;  // of the squares of what is left of a column
  if (cholesky.info() != Eigen::Success ||
      cholesky.matrixLLT().diagonal().cwiseAbs2().minCoeff() < dependent) {
    return {};
  }
  return scale.asDiagonal() * cholesky.solve(Eigen::MatrixXd::Identity(N.rows(), N.cols())) *
         scale.asDiagonal();
}

}  // namespace

LinearisedRun::LinearisedRun(const ReadingSet& set, const Estimate& estimate, bool known_field)
    : set_(set), sigma_(estimate.statistics.residual_sd) {
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  const Eigen::Index p = set.column_count();
  const JointState state = JointFit(set, set.weights).at(estimate.field);
  const Eigen::Index D = known_field || !estimate.field.has_vectors() ? 0 : state.direction_count();
  J_ = Eigen::MatrixXd::Zero(n * m, p * m + D);
  r_.resize(n * m);
  along_.resize(n, m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    sigma_(k) = std::max({sigma_(k), set.rounding(k), std::numeric_limits<double>::min()});
    const auto rows = Eigen::seqN(k, n, m);
    const Eigen::VectorXd root = axis.root_weights / sigma_(k);
    J_(rows, Eigen::seqN(p * k, p)) = root.asDiagonal() * axis.X;
    J_(rows, Eigen::seqN(p * m, D)) = axis.tangents.leftCols(D) / sigma_(k);
    r_(rows) = axis.residuals / sigma_(k);
    along_.col(k) = root.cwiseProduct(axis.X.middleCols<3>(1) *
                                      estimate.response.sensitivity.row(k).transpose());
    rows_ += static_cast<double>((root.array() > 0.0).count());
    designs_.push_back(axis.X);
  }
  C_ = inverse_information(J_);
  if (C_.size() > 0) {
    r_ -= J_ * (C_ * (J_.transpose() * r_));  // by the axes' own scatter, at one step
  }
}

Eigen::Matrix<double, Eigen::Dynamic, 3> LinearisedRun::field_met(Eigen::Index axis) const {
  return designs_[static_cast<std::size_t>(axis)].middleCols<3>(1);
}

Eigen::MatrixXd LinearisedRun::own_columns(Eigen::Index axis) const {
  const Eigen::Index p = set_.column_count();
  const Eigen::Index shared = J_.cols() - p * axes();
  const auto rows = Eigen::seqN(axis, readings(), axes());
  const Eigen::VectorXd scale =
      sigma_(axis) * set_.weights.col(axis).cwiseSqrt().cwiseMax(1e-150).cwiseInverse();
  const Eigen::Index c = set_.coefficient_count();
  Eigen::MatrixXd own(readings(), c + shared);
  own << designs_[static_cast<std::size_t>(axis)].leftCols(c),
      scale.asDiagonal() * J_(rows, Eigen::lastN(shared));
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
