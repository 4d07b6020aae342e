// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace axiscal {

/// Cholesky's factor of a symmetric matrix whose size the compiler knows: A = L L^T. Written out,
/// so that of a few rows no loop is left; Eigen's own takes ten times the instructions for them.
template <int N>
class FixedCholesky {
 public:
  using Square = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;

  /// @param A  symmetric: the lower triangle alone is read.
  explicit FixedCholesky(const Square& A) : factor_(Square::Zero()) {
    for (int j = 0; j < N; ++j) {
      double pivot = A(j, j);
      for (int l = 0; l < j; ++l) {
        pivot -= factor_(j, l) * factor_(j, l);
      }
      if (!(pivot > 0.0)) {
        is_positive_ = false;
        return;
      }
      const double root = std::sqrt(pivot);
      factor_(j, j) = root;
      for (int i = j + 1; i < N; ++i) {
        double sum = A(i, j);
        for (int l = 0; l < j; ++l) {
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
    Square inverse = Square::Zero();
    for (int j = 0; j < N; ++j) {
      inverse(j, j) = 1.0 / factor_(j, j);
      for (int i = j + 1; i < N; ++i) {
        double sum = 0.0;
        for (int l = j; l < i; ++l) {
          sum += factor_(i, l) * inverse(l, j);
        }
        inverse(i, j) = -sum / factor_(i, i);
      }
    }
    return inverse;
  }

  /// @return x with A x = b.
  [[nodiscard]] Vector solve(Vector b) const {
    for (int i = 0; i < N; ++i) {
      for (int l = 0; l < i; ++l) {
        b(i) -= factor_(i, l) * b(l);
      }
      b(i) /= factor_(i, i);
    }
    for (int i = N - 1; i >= 0; --i) {
      for (int l = i + 1; l < N; ++l) {
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
