// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

// Wrappers of the matrix decompositions that calib uses. Because most files use only these
// wrappers, ranks, condition numbers and inverses are computed in one way, and Eigen's templates
// are compiled only once.

/// A matrix J, n x p, factored by QR with column pivoting. Its columns are scaled to length 1.
///
/// The solution is not refined. This is accurate enough for the steps of an iteration.
/// LeastSquaresDesign refines its solutions.
///
/// @par Source
/// Golub & Van Loan, Matrix Computations, 4th ed. (2013), secs. 5.3, 5.4.
/// @par Example
/// @code
/// const Factor factor(J);
/// if (factor.has_full_rank()) {
///   const Eigen::VectorXd step = factor.solve(r);
/// }
/// @endcode
class Factor {
 public:
  /// @param open_below  a pivot counts as 0 if it is below `open_below` times the largest pivot;
  ///                    default: Eigen's limit for rounding errors.
  explicit Factor(const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
                  std::optional<double> open_below = {});

  [[nodiscard]] Eigen::Index rank() const;
  [[nodiscard]] bool has_full_rank() const;

  // The functions from here on need full rank.

  /// @return the s that minimises |J s - r|, p entries.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& r) const;

  /// @return T, p x p, with T T^T = (J^T J)^-1 and J T orthonormal.
  [[nodiscard]] Eigen::MatrixXd root_of_covariance() const;

  /// @return (J^T J)^-1, p x p.
  [[nodiscard]] Eigen::MatrixXd covariance() const;

  /// @return the diagonal of the hat matrix, n entries.
  [[nodiscard]] Eigen::VectorXd leverage() const;

 private:
  struct Parts;
  std::shared_ptr<const Parts> parts_;
};

/// A positive definite matrix N, p x p, factored by Cholesky's method. Its rows and columns are
/// first scaled so that its diagonal is 1. Use it for normal equations of columns in any units.
class PositiveFactor {
 public:
  /// @param damping  number that is added to each diagonal entry of the scaled matrix.
  explicit PositiveFactor(const Eigen::MatrixXd& normal, double damping = 0.0);

  /// @return true if N is positive definite and finite, and if every pivot is above `open_below`. A
  ///         pivot is the square of a diagonal entry of the scaled matrix's Cholesky factor.
  [[nodiscard]] bool is_determined(double open_below = 0.0) const;

  // The functions from here on need a positive definite N.

  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;
  [[nodiscard]] Eigen::MatrixXd inverse() const;

  /// @return B with B B^T = N^-1.
  [[nodiscard]] Eigen::MatrixXd root_of_inverse() const;

  [[nodiscard]] double log_determinant() const;

 private:
  struct Parts;
  std::shared_ptr<const Parts> parts_;
};

/// The matrix L^-1 for a covariance V = L L^T. It transforms errors with covariance V to
/// independent errors with variance 1.
class Whitening {
 public:
  explicit Whitening(const Eigen::MatrixXd& V);

  /// @return true if V is positive definite.
  [[nodiscard]] bool is_valid() const;

  /// @return L^-1 B.
  [[nodiscard]] Eigen::MatrixXd times(const Eigen::MatrixXd& B) const;

  /// @return L^-T B.
  [[nodiscard]] Eigen::MatrixXd transposed_times(const Eigen::MatrixXd& B) const;

  /// @return L, lower triangular.
  [[nodiscard]] Eigen::MatrixXd root() const;

 private:
  struct Parts;
  std::shared_ptr<const Parts> parts_;
};

/// @return the solution X of A X = B for a symmetric matrix A that is semidefinite up to rounding
///         errors. It is computed by A = L D L^T with pivoting.
[[nodiscard]] Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// @return true if the symmetric matrix A is finite and its pivots show that it is positive
///         semidefinite.
[[nodiscard]] bool is_semi_definite(const Eigen::MatrixXd& A);

/// @return A^-1 of a square matrix by LU with partial pivoting.
[[nodiscard]] Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& A);

/// The eigenvalues of a symmetric matrix, ascending, with orthonormal eigenvectors as columns.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
[[nodiscard]] SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A);

/// The singular value decomposition A = U diag(values) V^T of an n x p matrix A. The values are in
/// descending order. U is n x min(n, p), and V is p x min(n, p).
struct SingularValues {
  Eigen::MatrixXd U;
  Eigen::VectorXd values;
  Eigen::MatrixXd V;
};
[[nodiscard]] SingularValues singular_values(const Eigen::MatrixXd& A);

/// @return L with L L^T = C for a covariance C of any rank.
[[nodiscard]] Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance);

/// @return the vector x that minimises |A x - b|; if there are several, the one of smallest norm.
///         It is computed by complete orthogonal decomposition (Golub & Van Loan, sec. 5.5).
[[nodiscard]] Eigen::VectorXd minimum_norm_solution(const Eigen::MatrixXd& A,
                                                    const Eigen::VectorXd& b);

/// @return the Moore-Penrose inverse A^+, by complete orthogonal decomposition.
[[nodiscard]] Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A);

/// The Moore-Penrose inverse of a matrix, and the rank of the matrix to working precision.
struct PseudoInverseWithRank {
  Eigen::MatrixXd inverse;
  Eigen::Index rank = 0;
};
[[nodiscard]] PseudoInverseWithRank pseudo_inverse_with_rank(const Eigen::MatrixXd& A);

/// @return T with T T^T = (A^T A)^+. Singular values of A that are not above `open_below` count as
///         0.
[[nodiscard]] Eigen::MatrixXd root_of_pseudo_inverse(const Eigen::MatrixXd& A, double open_below);

/// @return orthonormal columns that span the columns of A, which has full rank; n x p.
[[nodiscard]] Eigen::MatrixXd orthonormal_basis(const Eigen::MatrixXd& A);

/// @return orthonormal columns that are orthogonal to those of A, which has full rank; n x (n - p).
[[nodiscard]] Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& A);

/// @return the columns of J that are nearly undetermined. The columns are first scaled to length 1.
///         Singular values below `open_below` times the largest one count as small. A column is
///         nearly undetermined if its component in a right singular vector of a small value is
///         above `share_above`. J must have at least as many rows as columns.
[[nodiscard]] std::vector<Eigen::Index> confounded_columns(const Eigen::MatrixXd& J,
                                                           double open_below,
                                                           double share_above);

/// @return the names of the given columns. If consecutive columns have the same name, it occurs
///         only once.
[[nodiscard]] std::vector<std::string> undetermined_column_names(
    const std::vector<Eigen::Index>& columns, const std::vector<std::string>& names);

/// @return the ratio of the largest to the smallest singular value of J, after the columns of J are
///         scaled to length 1.
[[nodiscard]] double condition_of(const Eigen::MatrixXd& J);

/// Like condition_of(), but faster, because it uses the normal equations J^T J.
/// @return `nullopt` if the condition number is 100 or more, because J^T J is then too inaccurate.
[[nodiscard]] std::optional<double> condition_from_normal_matrix(const Eigen::MatrixXd& normal);

}  // namespace axiscal
