// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "axiscal/calib/fixed_cholesky.hpp"

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
      : per_length_(normal.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse()),
        cholesky_(scaled(normal, per_length_, damping)) {}

  /// @param open_below  the part of a column's square that must be left beside the columns before
  ///                    it.
  /// @return whether all columns have it, and N is positive definite and finite.
  [[nodiscard]] bool is_determined(double open_below) const {
    return is_positive() && (factor().diagonal().array().square() > open_below).all();
  }

  /// The following need a positive definite N.

  [[nodiscard]] Vector solve(const Vector& right) const {
    return per_length_.cwiseProduct(cholesky_.solve(per_length_.cwiseProduct(right)));
  }

  [[nodiscard]] Matrix inverse() const {
    if constexpr (is_fixed) {
      const Matrix root = root_of_inverse();
      return root.lazyProduct(root.transpose());
    } else {
      return per_length_.asDiagonal() *
             cholesky_.solve(Matrix::Identity(per_length_.size(), per_length_.size())) *
             per_length_.asDiagonal();
    }
  }

  /// @return B with B B^T = N^-1.
  [[nodiscard]] Matrix root_of_inverse() const {
    if constexpr (is_fixed) {
      return per_length_.asDiagonal() * cholesky_.inverse_of_factor().transpose();
    } else {
      Matrix root = Matrix::Identity(per_length_.size(), per_length_.size());
      cholesky_.matrixU().solveInPlace(root);
      return per_length_.asDiagonal() * root;
    }
  }

  [[nodiscard]] double log_determinant() const {
    return 2.0 * (factor().diagonal().array() / per_length_.array()).log().sum();
  }

 private:
  static constexpr bool is_fixed = Matrix::RowsAtCompileTime != Eigen::Dynamic;

  using Cholesky = std::conditional_t<is_fixed,
                                      FixedCholesky<is_fixed ? Matrix::RowsAtCompileTime : 1>,
                                      Eigen::LLT<Matrix>>;

  static Matrix scaled(const Matrix& normal, const Vector& per_length, double damping) {
    Matrix scaled = per_length.asDiagonal() * normal * per_length.asDiagonal();
    scaled.diagonal().array() += damping;
    return scaled;
  }

  [[nodiscard]] bool is_positive() const {
    if constexpr (is_fixed) {
      return cholesky_.is_positive();
    } else {
      return cholesky_.info() == Eigen::Success;
    }
  }

  [[nodiscard]] const Matrix& factor() const {
    if constexpr (is_fixed) {
      return cholesky_.factor();
    } else {
      return cholesky_.matrixLLT();
    }
  }

  Vector per_length_;  // p
  Cholesky cholesky_;
};

extern template class ScaledCholeskyOf<Eigen::MatrixXd>;
using ScaledCholesky = ScaledCholeskyOf<Eigen::MatrixXd>;

}  // namespace axiscal
