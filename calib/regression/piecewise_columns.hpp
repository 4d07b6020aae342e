// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Consecutive rows, and the columns with a nonzero value in at least one of these rows.
struct ColumnPiece {
  Eigen::Index first = 0;  ///< index of the piece's first row
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd W;  ///< the part of the whole matrix in these rows and columns
};

/// Columns that are replaced by the same number of columns with the same span.
struct ReplacedColumns {
  std::vector<Eigen::Index> columns;
  /// matrix that maps the coefficients of the new columns to those of the replaced columns
  Eigen::MatrixXd to_given;
};

/// A matrix W with c columns, transformed to a sparse basis and divided into pieces of consecutive
/// rows. Some columns of W are constant within blocks of rows. If the number of these columns
/// equals the number of blocks, they are replaced by one column for each block. Each piece contains
/// only its nonzero columns, so the work for a piece does not depend on c.
struct PiecewiseColumns {
  Eigen::Index count = 0;  ///< c, the number of columns of W
  std::vector<ColumnPiece> pieces;
  std::vector<ReplacedColumns> replaced;

  /// @return the coefficients b of the columns of W, computed from the coefficients in the basis.
  [[nodiscard]] Eigen::VectorXd estimate_of(Eigen::VectorXd in_basis) const;

  /// @return the covariance of b, computed from the covariance in the basis.
  [[nodiscard]] Eigen::MatrixXd covariance_of(Eigen::MatrixXd in_basis) const;
};

/// Divides a matrix into pieces.
/// @param W     the matrix, n m x c: m consecutive rows for each of n units.
/// @param rows  m, the number of rows of each unit.
/// @param kept  number of columns at the end of W that are not replaced.
[[nodiscard]] PiecewiseColumns piecewise_columns(const Eigen::MatrixXd& W,
                                                 Eigen::Index rows,
                                                 Eigen::Index kept);

}  // namespace axiscal
