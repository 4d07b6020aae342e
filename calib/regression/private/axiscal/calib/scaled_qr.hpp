// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/QR>

namespace axiscal {

/// A Jacobian J, n x p, factored by QR with column pivoting, its columns scaled to length 1.
///
/// For steps of a fit that mends its own rounding in the next round: nothing is refined, as
/// LeastSquaresDesign does where the answer must be right at once.
///
/// @par Source
/// Golub & Van Loan, Matrix Computations, 4th ed. (2013), secs. 5.3, 5.4.
class ScaledQr {
 public:
  /// @param smallest_pivot  below this part of the largest a pivot counts as zero; by default what
  ///                        rounding makes of zero.
  explicit ScaledQr(const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
                    std::optional<double> smallest_pivot = {});

  [[nodiscard]] Eigen::Index rank() const { return qr_.rank(); }
  [[nodiscard]] bool has_full_rank() const { return qr_.rank() == qr_.cols(); }

  /// The following need full rank.

  /// @return the s that makes |J s - r| smallest, p entries.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& r) const;

  /// @return T, p x p, with T T^T = (J^T J)^-1 and J T orthonormal.
  [[nodiscard]] Eigen::MatrixXd root_of_covariance() const;

  /// @return (J^T J)^-1, p x p.
  [[nodiscard]] Eigen::MatrixXd covariance() const;

  /// @return diagonal of the hat matrix, n entries.
  [[nodiscard]] Eigen::VectorXd leverage() const;

 private:
  Eigen::VectorXd per_length_;  // p
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr_;
};

/// Columns that are as good as open: with a part of more than `share_above` in a direction whose
/// singular value, columns of length 1, is below `open_below` of the largest.
/// @param J  with as many rows as columns, or more.
[[nodiscard]] std::vector<Eigen::Index> confounded_columns(const Eigen::MatrixXd& J,
                                                           double open_below,
                                                           double share_above);

/// @return the names of columns, each once where neighbours share it.
[[nodiscard]] std::vector<std::string> names_of_open(const std::vector<Eigen::Index>& columns,
                                                     const std::vector<std::string>& names);

/// @return orthonormal columns that are orthogonal to the given ones, n x (n - p).
[[nodiscard]] Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& columns);

/// @return ratio of the largest to the smallest singular value of J with columns of length 1.
[[nodiscard]] double condition_of(const Eigen::MatrixXd& J);

/// The same by the normal equations J^T J, which are less work.
/// @return nothing above 100, where they cost digits that matter.
[[nodiscard]] std::optional<double> small_condition_of(const Eigen::MatrixXd& normal);

}  // namespace axiscal
