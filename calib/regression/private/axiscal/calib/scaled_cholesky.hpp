// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace axiscal {

/// The Cholesky factor of normal equations N, p x p, judged and solved with columns of length 1: a
/// diagonal of ones, whatever the units.
class ScaledCholesky {
 public:
  /// @param damping  added to each of the ones.
  explicit ScaledCholesky(const Eigen::MatrixXd& normal, double damping = 0.0);

  /// @param open_below  the part of a column's square that must be left beside the columns before
  ///                    it.
  /// @return whether all columns have it, and N is positive definite and finite.
  [[nodiscard]] bool is_determined(double open_below) const;

  /// The following need a positive definite N.

  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  [[nodiscard]] Eigen::MatrixXd inverse() const;

  /// @return B with B B^T = N^-1.
  [[nodiscard]] Eigen::MatrixXd root_of_inverse() const;

  [[nodiscard]] double log_determinant() const;

 private:
  Eigen::VectorXd per_length_;  // p
  Eigen::LLT<Eigen::MatrixXd> cholesky_;
};

}  // namespace axiscal
