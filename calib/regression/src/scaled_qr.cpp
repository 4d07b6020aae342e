// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/scaled_qr.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace axiscal {
namespace {

Eigen::VectorXd per_length_of(const Eigen::Ref<const Eigen::MatrixXd>& J) {
  return J.colwise().norm().cwiseMax(1e-300).cwiseInverse();
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
  const std::optional<double> condition = small_condition_of(J.transpose() * J);
  if (condition && *condition * open_below < 1.0) {
    return {};
  }
  const Eigen::MatrixXd scaled = J * per_length_of(J).asDiagonal();
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

std::optional<double> small_condition_of(const Eigen::MatrixXd& normal) {
  const Eigen::VectorXd per_length = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = per_length.asDiagonal() * normal * per_length.asDiagonal();
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled, Eigen::EigenvaluesOnly).eigenvalues();
  constexpr double most = 1e4;  // the condition number's square
  const double ratio = values(values.size() - 1) / values(0);
  return ratio > 0.0 && ratio < most ? std::optional(std::sqrt(ratio)) : std::nullopt;
}

}  // namespace axiscal
