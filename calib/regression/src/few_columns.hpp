// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Core>

namespace axiscal {

// Most designs have the columns [1, f] of a triad, and few rows.
inline constexpr int few_columns = 4;
inline constexpr Eigen::Index most_of_few_rows = 48;

// As many numbers as there are parameters.
template <int Count>
using OfParameters = Eigen::Matrix<double, Count, 1>;

// Products with matrices of n rows, written out where their columns are few.
template <int Count>
OfParameters<Count> transposed_times(const Eigen::MatrixXd& A,
                                     const Eigen::Ref<const Eigen::VectorXd>& y) {
  if constexpr (Count == Eigen::Dynamic) {
    return A.transpose() * y;
  } else {
    OfParameters<Count> sums = OfParameters<Count>::Zero();
    for (Eigen::Index i = 0; i < y.size(); ++i) {
      for (int j = 0; j < Count; ++j) {
        sums(j) += A(i, j) * y(i);
      }
    }
    return sums;
  }
}

// Leaves y less A x.
template <int Count>
void put_less_times(const Eigen::Ref<const Eigen::VectorXd>& y,
                    const Eigen::MatrixXd& A,
                    const OfParameters<Count>& x,
                    Eigen::VectorXd& left) {
  left.resize(y.size());
  if constexpr (Count == Eigen::Dynamic) {
    left.noalias() = -A * x;
    left += y;
  } else {
    for (Eigen::Index i = 0; i < y.size(); ++i) {
      double sum = 0.0;
      for (int j = 0; j < Count; ++j) {
        sum += A(i, j) * x(j);
      }
      left(i) = y(i) - sum;
    }
  }
}

template <int Count>
OfParameters<Count> square_times(const Eigen::MatrixXd& A, const OfParameters<Count>& x) {
  if constexpr (Count == Eigen::Dynamic) {
    return A * x;
  } else {
    return Eigen::Map<const Eigen::Matrix<double, Count, Count>>(A.data()).lazyProduct(x);
  }
}

// A P = Q R of few columns by Householder's reflections, the longest column first at each step.
// @tparam Count  of the columns.
template <int Count>
struct PivotedR {
  // @param A  n x Count, n >= Count; used up.
  template <typename Rows>
  explicit PivotedR(Rows A) {
    const Eigen::Index n = A.rows();
    for (int k = 0; k < Count; ++k) {
      order[static_cast<std::size_t>(k)] = k;
    }
    for (int k = 0; k < Count; ++k) {
      int longest = k;
      double squares = -1.0;
      for (int j = k; j < Count; ++j) {
        double sum = 0.0;
        for (Eigen::Index i = k; i < n; ++i) {
          sum += A(i, j) * A(i, j);
        }
        if (sum > squares) {
          squares = sum;
          longest = j;
        }
      }
      if (longest != k) {
        A.col(k).swap(A.col(longest));
        R.col(k).swap(R.col(longest));
        std::swap(order[static_cast<std::size_t>(k)], order[static_cast<std::size_t>(longest)]);
      }
      // v = (1, ...) of the reflection I - tau v v^T that leaves the pivot alone.
      const double first = A(k, k);
      const double pivot = first > 0.0 ? -std::sqrt(squares) : std::sqrt(squares);
      R(k, k) = pivot;
      if (!(squares > 0.0)) {
        return;
      }
      const double tau = (pivot - first) / pivot;
      const double per_first = 1.0 / (first - pivot);
      for (Eigen::Index i = k + 1; i < n; ++i) {
        A(i, k) *= per_first;
      }
      for (int j = k + 1; j < Count; ++j) {
        double sum = A(k, j);
        for (Eigen::Index i = k + 1; i < n; ++i) {
          sum += A(i, k) * A(i, j);
        }
        sum *= tau;
        R(k, j) = A(k, j) - sum;
        for (Eigen::Index i = k + 1; i < n; ++i) {
          A(i, j) -= sum * A(i, k);
        }
      }
    }
  }

  // P R^-1.
  [[nodiscard]] Eigen::Matrix<double, Count, Count> root() const {
    Eigen::Matrix<double, Count, Count> all = Eigen::Matrix<double, Count, Count>::Zero();
    for (int j = 0; j < Count; ++j) {
      std::array<double, static_cast<std::size_t>(Count)> x{};
      for (int i = j; i >= 0; --i) {
        double sum = i == j ? 1.0 : 0.0;
        for (int l = i + 1; l <= j; ++l) {
          sum -= R(i, l) * x[static_cast<std::size_t>(l)];
        }
        x[static_cast<std::size_t>(i)] = sum / R(i, i);
        all(order[static_cast<std::size_t>(i)], j) = x[static_cast<std::size_t>(i)];
      }
    }
    return all;
  }

  Eigen::Matrix<double, Count, Count> R = Eigen::Matrix<double, Count, Count>::Zero();
  std::array<int, static_cast<std::size_t>(Count)> order{};
};

// Of columns of length 1 the Frobenius norms of A and of its pseudo-inverse bound the condition
// number, up to p times above it: most designs need not ask for more.
template <typename Rows, typename Square>
double bound_of_condition(const Rows& A, const Square& root) {
  double squares = 0.0;
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    squares += A.col(j).squaredNorm() * root.row(j).squaredNorm();
  }
  return std::sqrt(static_cast<double>(A.cols()) * squares);
}

}  // namespace axiscal
