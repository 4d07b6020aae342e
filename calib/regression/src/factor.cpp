// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/factor.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace axiscal {
namespace {

Eigen::VectorXd per_length_of(const Eigen::Ref<const Eigen::MatrixXd>& J) {
  return J.colwise().norm().cwiseMax(1e-300).cwiseInverse();
}

}  // namespace

struct Factor::Parts {
  Eigen::VectorXd per_length;  // 1 / length of each column of J, p entries
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
};

Factor::Factor(const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
               std::optional<double> open_below) {
  const auto parts = std::make_shared<Parts>();
  parts->per_length = per_length_of(jacobian);
  parts->qr.compute(jacobian * parts->per_length.asDiagonal());
  if (open_below) {
    parts->qr.setThreshold(*open_below);
  }
  parts_ = parts;
}

Eigen::Index Factor::rank() const {
  return parts_->qr.rank();
}

bool Factor::has_full_rank() const {
  return parts_->qr.rank() == parts_->qr.cols();
}

Eigen::VectorXd Factor::solve(const Eigen::VectorXd& r) const {
  return parts_->per_length.cwiseProduct(parts_->qr.solve(r).eval());
}

Eigen::MatrixXd Factor::root_of_covariance() const {
  const Eigen::Index p = parts_->qr.cols();
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(p, p);
  parts_->qr.matrixQR().topRows(p).triangularView<Eigen::Upper>().solveInPlace(inverse);
  return parts_->per_length.asDiagonal() * (parts_->qr.colsPermutation() * inverse);
}

Eigen::MatrixXd Factor::covariance() const {
  const Eigen::MatrixXd root = root_of_covariance();
  return root * root.transpose();
}

Eigen::VectorXd Factor::leverage() const {
  const Eigen::MatrixXd Q =
      parts_->qr.householderQ() * Eigen::MatrixXd::Identity(parts_->qr.rows(), parts_->qr.cols());
  return Q.rowwise().squaredNorm();
}

struct PositiveFactor::Parts {
  Parts(const Eigen::MatrixXd& normal, double damping)
      : per_length(normal.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse()),
        factored(per_length.asDiagonal() * normal * per_length.asDiagonal()) {
    factored.diagonal().array() += damping;
    cholesky.emplace(factored);
  }

  Eigen::VectorXd per_length;  // 1 / square root of each diagonal entry of N, p entries
  Eigen::MatrixXd factored;    // the scaled matrix, which `cholesky` overwrites by its factor
  std::optional<Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>> cholesky;
};

PositiveFactor::PositiveFactor(const Eigen::MatrixXd& normal, double damping)
    : parts_(std::make_shared<Parts>(normal, damping)) {}

bool PositiveFactor::is_determined(double open_below) const {
  return parts_->cholesky->info() == Eigen::Success &&
         (parts_->cholesky->matrixLLT().diagonal().array().square() > open_below).all();
}

Eigen::MatrixXd PositiveFactor::solve(const Eigen::MatrixXd& right) const {
  const auto per_length = parts_->per_length.array();
  Eigen::MatrixXd solution = right;
  solution.array().colwise() *= per_length;
  // For small matrices, a loop over the columns is faster than one solution for all columns.
  for (auto column : solution.colwise()) {
    parts_->cholesky->solveInPlace(column);
  }
  solution.array().colwise() *= per_length;
  return solution;
}

Eigen::MatrixXd PositiveFactor::inverse() const {
  const Eigen::Index p = parts_->per_length.size();
  return solve(Eigen::MatrixXd::Identity(p, p));
}

Eigen::MatrixXd PositiveFactor::root_of_inverse() const {
  const Eigen::Index p = parts_->per_length.size();
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(p, p);
  for (auto column : root.colwise()) {
    parts_->cholesky->matrixU().solveInPlace(column);
  }
  root.array().colwise() *= parts_->per_length.array();
  return root;
}

double PositiveFactor::log_determinant() const {
  return 2.0 * (parts_->cholesky->matrixLLT().diagonal().array() / parts_->per_length.array())
                   .log()
                   .sum();
}

struct Whitening::Parts {
  Eigen::LLT<Eigen::MatrixXd> cholesky;
};

Whitening::Whitening(const Eigen::MatrixXd& V)
    : parts_(std::make_shared<Parts>(Parts{.cholesky = Eigen::LLT<Eigen::MatrixXd>(V)})) {}

bool Whitening::is_valid() const {
  return parts_->cholesky.info() == Eigen::Success;
}

Eigen::MatrixXd Whitening::times(const Eigen::MatrixXd& B) const {
  return parts_->cholesky.matrixL().solve(B);
}

Eigen::MatrixXd Whitening::transposed_times(const Eigen::MatrixXd& B) const {
  return parts_->cholesky.matrixU().solve(B);
}

Eigen::MatrixXd Whitening::root() const {
  return parts_->cholesky.matrixL();
}

Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  return Eigen::LDLT<Eigen::MatrixXd>(A).solve(B);
}

bool is_semi_definite(const Eigen::MatrixXd& A) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(A);
  return ldlt.info() == Eigen::Success && ldlt.isPositive();
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& A) {
  switch (A.rows()) {
    case 2:
      return Eigen::Matrix2d(A).inverse();
    case 3:
      return Eigen::Matrix3d(A).inverse();
    default:
      return A.inverse();
  }
}

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(A);
  return {.values = solver.eigenvalues(), .vectors = solver.eigenvectors()};
}

SingularValues singular_values(const Eigen::MatrixXd& A) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {.U = svd.matrixU(), .values = svd.singularValues(), .V = svd.matrixV()};
}

Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance) {
  const SymmetricEigen eigen = symmetric_eigen(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

Eigen::VectorXd minimum_norm_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(A).solve(b);
}

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A) {
  return pseudo_inverse_with_rank(A).inverse;
}

PseudoInverseWithRank pseudo_inverse_with_rank(const Eigen::MatrixXd& A) {
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition(A);
  return {.inverse = decomposition.pseudoInverse(), .rank = decomposition.rank()};
}

Eigen::MatrixXd root_of_pseudo_inverse(const Eigen::MatrixXd& A, double open_below) {
  const SingularValues svd = singular_values(A);
  const Eigen::Index rank = (svd.values.array() > open_below).count();
  return svd.V.leftCols(rank) * svd.values.head(rank).cwiseInverse().asDiagonal();
}

Eigen::MatrixXd orthonormal_basis(const Eigen::MatrixXd& A) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(A);
  return qr.householderQ() * Eigen::MatrixXd::Identity(A.rows(), A.cols());
}

Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& A) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(A);
  const Eigen::MatrixXd Q = qr.householderQ() * Eigen::MatrixXd::Identity(A.rows(), A.rows());
  return Q.rightCols(A.rows() - A.cols());
}

std::vector<Eigen::Index> confounded_columns(const Eigen::MatrixXd& J,
                                             double open_below,
                                             double share_above) {
  const std::optional<double> condition = condition_from_normal_matrix(J.transpose() * J);
  if (condition && *condition * open_below < 1.0) {
    return {};
  }
  const SingularValues svd = singular_values(J * per_length_of(J).asDiagonal());
  std::vector<Eigen::Index> open;
  for (Eigen::Index j = 0; j < J.cols(); ++j) {
    double share = 0.0;
    for (Eigen::Index s = 0; s < J.cols(); ++s) {
      if (svd.values(s) < open_below * svd.values(0)) {
        share = std::max(share, std::abs(svd.V(j, s)));
      }
    }
    if (share > share_above) {
      open.push_back(j);
    }
  }
  return open;
}

std::vector<std::string> undetermined_column_names(const std::vector<Eigen::Index>& columns,
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

double condition_of(const Eigen::MatrixXd& J) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(J * per_length_of(J).asDiagonal());
  const Eigen::MatrixXd R =
      qr.matrixQR().topRows(J.cols()).triangularView<Eigen::Upper>().toDenseMatrix();
  const Eigen::VectorXd singular = singular_values(R).values;
  return singular(0) / singular(singular.size() - 1);
}

std::optional<double> condition_from_normal_matrix(const Eigen::MatrixXd& normal) {
  const Eigen::VectorXd per_length = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(
          per_length.asDiagonal() * normal * per_length.asDiagonal(), Eigen::EigenvaluesOnly)
          .eigenvalues();
  constexpr double most = 1e4;  // limit of the squared condition number
  const double ratio = values(values.size() - 1) / values(0);
  return ratio > 0.0 && ratio < most ? std::optional(std::sqrt(ratio)) : std::nullopt;
}

}  // namespace axiscal
