// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace axiscal {

/// Cholesky's factor of a small symmetric matrix: A = L L^T. Written out, so that of a few rows
/// whose number the compiler knows no loop is left; Eigen's own takes ten times the instructions
/// for them.
/// @tparam N  the number of rows, or Eigen::Dynamic for any up to `most`.
template <int N>
class FixedCholesky {
 public:
  static constexpr int most = N == Eigen::Dynamic ? 16 : N;
  using Square = Eigen::Matrix<double, N, N, Eigen::ColMajor, most, most>;
  using Vector = Eigen::Matrix<double, N, 1, Eigen::ColMajor, most, 1>;

  /// @param A  symmetric: the lower triangle alone is read.
  explicit FixedCholesky(const Square& A) : factor_(Square::Zero(A.rows(), A.rows())) {
    const Eigen::Index n = A.rows();
    for (Eigen::Index j = 0; j < n; ++j) {
      double pivot = A(j, j);
      for (Eigen::Index l = 0; l < j; ++l) {
        pivot -= factor_(j, l) * factor_(j, l);
      }
      if (!(pivot > 0.0)) {
        is_positive_ = false;
        return;
      }
      const double root = std::sqrt(pivot);
      factor_(j, j) = root;
      for (Eigen::Index i = j + 1; i < n; ++i) {
        double sum = A(i, j);
        for (Eigen::Index l = 0; l < j; ++l) {
          sum -= factor_(i, l) * factor_(j, l);
        }
        factor_(i, j) = sum / root;
      }
    }
  }

  /// @return whether A is positive definite; what follows needs that.
  [[nodiscard]] bool is_positive() const { return is_positive_; }

  /// @return L.
  [[nodiscard]] const Square& factor() const { return factor_; }

  /// @return L^-1.
  [[nodiscard]] Square inverse_of_factor() const {
    const Eigen::Index n = factor_.rows();
    Square inverse = Square::Zero(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      inverse(j, j) = 1.0 / factor_(j, j);
      for (Eigen::Index i = j + 1; i < n; ++i) {
        double sum = 0.0;
        for (Eigen::Index l = j; l < i; ++l) {
          sum += factor_(i, l) * inverse(l, j);
        }
        inverse(i, j) = -sum / factor_(i, i);
      }
    }
    return inverse;
  }

  /// @return x with A x = b.
  [[nodiscard]] Vector solve(Vector b) const {
    const Eigen::Index n = factor_.rows();
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index l = 0; l < i; ++l) {
        b(i) -= factor_(i, l) * b(l);
      }
      b(i) /= factor_(i, i);
    }
    for (Eigen::Index i = n - 1; i >= 0; --i) {
      for (Eigen::Index l = i + 1; l < n; ++l) {
        b(i) -= factor_(l, i) * b(l);
      }
      b(i) /= factor_(i, i);
    }
    return b;
  }

 private:
  Square factor_;
  bool is_positive_ = true;
};

}  // namespace axiscal
