// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

// Compiled in one place: each use of these decompositions costs a compiler seconds.

/// @return the x of smallest norm among those that make |A x - b| smallest, by complete orthogonal
///         decomposition (Golub & Van Loan, Matrix Computations, 4th ed. (2013), sec. 5.5).
[[nodiscard]] Eigen::VectorXd minimum_norm_solution(const Eigen::MatrixXd& A,
                                                    const Eigen::VectorXd& b);

/// @return the Moore-Penrose inverse of A, by the same decomposition.
[[nodiscard]] Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A);

struct RankedInverse {
  Eigen::MatrixXd inverse;
  Eigen::Index rank = 0;
};

/// The same, and how many columns of A are independent to working precision.
[[nodiscard]] RankedInverse ranked_inverse(const Eigen::MatrixXd& A);

}  // namespace axiscal
