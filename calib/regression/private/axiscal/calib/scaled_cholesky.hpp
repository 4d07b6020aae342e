// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

namespace axiscal {

/// The Cholesky factor of normal equations N, p x p, judged and solved with columns of length 1: a
/// diagonal of ones, whatever the units.
///
/// @tparam Matrix  dynamic, of at most so many rows, or of a fixed size: few need no memory of
/// their
///                 own.
template <typename Matrix>
class ScaledCholeskyOf {
 public:
  using Vector =
      Eigen::Matrix<double, Matrix::RowsAtCompileTime, 1, 0, Matrix::MaxRowsAtCompileTime, 1>;

  /// @param damping  added to each of the ones.
  explicit ScaledCholeskyOf(const Matrix& normal, double damping = 0.0)
      : per_length_(normal.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse()) {
    Matrix scaled = per_length_.asDiagonal() * normal * per_length_.asDiagonal();
    scaled.diagonal().array() += damping;
    cholesky_.compute(scaled);
  }

  /// @param open_below  the part of a column's square that must be left beside the columns before
  ///                    it.
  /// @return whether all columns have it, and N is positive definite and finite.
  [[nodiscard]] bool is_determined(double open_below) const {
    return cholesky_.info() == Eigen::Success &&
           (cholesky_.matrixLLT().diagonal().array().square() > open_below).all();
  }

  /// The following need a positive definite N.

  [[nodiscard]] Vector solve(const Vector& right) const {
    return per_length_.cwiseProduct(cholesky_.solve(per_length_.cwiseProduct(right)));
  }

  [[nodiscard]] Matrix inverse() const {
    constexpr int in_closed_form = 4;
    if constexpr (Matrix::RowsAtCompileTime != Eigen::Dynamic &&
                  Matrix::RowsAtCompileTime <= in_closed_form) {
      const Matrix root = Matrix(cholesky_.matrixL()).inverse() * per_length_.asDiagonal();
      return root.transpose() * root;
    } else {
      return per_length_.asDiagonal() *
             cholesky_.solve(Matrix::Identity(per_length_.size(), per_length_.size())) *
             per_length_.asDiagonal();
    }
  }

  /// @return B with B B^T = N^-1.
  [[nodiscard]] Matrix root_of_inverse() const {
    Matrix root = Matrix::Identity(per_length_.size(), per_length_.size());
    cholesky_.matrixU().solveInPlace(root);
    return per_length_.asDiagonal() * root;
  }

  [[nodiscard]] double log_determinant() const {
    return 2.0 *
           (cholesky_.matrixLLT().diagonal().array().log().sum() - per_length_.array().log().sum());
  }

 private:
  Vector per_length_;  // p
  Eigen::LLT<Matrix> cholesky_;
};

extern template class ScaledCholeskyOf<Eigen::MatrixXd>;
using ScaledCholesky = ScaledCholeskyOf<Eigen::MatrixXd>;

}  // namespace axiscal
