// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/scaled_qr.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/SVD>

namespace axiscal {
namespace {

Eigen::VectorXd per_length_of(const Eigen::Ref<const Eigen::MatrixXd>& J) {
  return J.colwise().norm().cwiseMax(1e-300).cwiseInverse();
}

// Whether no singular value of columns of length 1 is a smaller part of the largest, beyond doubt:
// the normal equations tell it to half of the digits, by a bound on the smallest.
bool is_well_conditioned(const Eigen::MatrixXd& scaled, double smallest) {
  const Eigen::LLT<Eigen::MatrixXd> cholesky(scaled.transpose() * scaled);
  if (cholesky.info() != Eigen::Success) {
    return false;
  }
  const Eigen::Index p = scaled.cols();
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(p, p);
  cholesky.matrixL().solveInPlace(root);
  constexpr double surely = 1e-5;
  return 1.0 / root.norm() > std::max(surely, std::sqrt(static_cast<double>(p)) * smallest);
}

}  // namespace

ScaledQr::ScaledQr(const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
                   std::optional<double> smallest_pivot)
    : per_length_(per_length_of(jacobian)), qr_(jacobian * per_length_.asDiagonal()) {
  if (smallest_pivot) {
    qr_.setThreshold(*smallest_pivot);
  }
}

Eigen::VectorXd ScaledQr::solve(const Eigen::VectorXd& r) const {
  return per_length_.cwiseProduct(qr_.solve(r).eval());
}

Eigen::MatrixXd ScaledQr::root_of_covariance() const {
  const Eigen::Index p = qr_.cols();
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(p, p);
  qr_.matrixQR().topRows(p).triangularView<Eigen::Upper>().solveInPlace(inverse);
  return per_length_.asDiagonal() * (qr_.colsPermutation() * inverse);
}

Eigen::MatrixXd ScaledQr::covariance() const {
  const Eigen::MatrixXd root = root_of_covariance();
  return root * root.transpose();
}

Eigen::VectorXd ScaledQr::leverage() const {
  const Eigen::MatrixXd Q = qr_.householderQ() * Eigen::MatrixXd::Identity(qr_.rows(), qr_.cols());
  return Q.rowwise().squaredNorm();
}

std::vector<Eigen::Index> confounded_columns(const Eigen::MatrixXd& J,
                                             double open_below,
                                             double share_above) {
  const Eigen::MatrixXd scaled = J * per_length_of(J).asDiagonal();
  if (is_well_conditioned(scaled, open_below)) {
    return {};
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeThinV);
  const Eigen::VectorXd& singular = svd.singularValues();
  std::vector<Eigen::Index> open;
  for (Eigen::Index j = 0; j < J.cols(); ++j) {
    double share = 0.0;
    for (Eigen::Index s = 0; s < J.cols(); ++s) {
      if (singular(s) < open_below * singular(0)) {
        share = std::max(share, std::abs(svd.matrixV()(j, s)));
      }
    }
    if (share > share_above) {
      open.push_back(j);
    }
  }
  return open;
}

std::vector<std::string> names_of_open(const std::vector<Eigen::Index>& columns,
                                       const std::vector<std::string>& names) {
  std::vector<std::string> open;
  for (const Eigen::Index j : columns) {
    const std::string& name = names[static_cast<std::size_t>(j)];
    if (open.empty() || open.back() != name) {
      open.push_back(name);
    }
  }
  return open;
}

Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& columns) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(columns);
  const Eigen::MatrixXd Q =
      qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), columns.rows());
  return Q.rightCols(columns.rows() - columns.cols());
}

double condition_of(const Eigen::MatrixXd& J) {
  const Eigen::MatrixXd scaled = J * per_length_of(J).asDiagonal();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(scaled);
  const Eigen::MatrixXd R =
      qr.matrixQR().topRows(J.cols()).triangularView<Eigen::Upper>().toDenseMatrix();
  const Eigen::VectorXd singular = Eigen::JacobiSVD<Eigen::MatrixXd>(R).singularValues();
  return singular(0) / singular(singular.size() - 1);
}

}  // namespace axiscal
