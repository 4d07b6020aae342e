// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Consecutive rows, and the columns with a nonzero value in at least one of these rows.
struct ColumnPiece {
  Eigen::Index first = 0;  ///< its first row among all
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd W;  ///< rows x columns.size()
};

/// Columns that make way for as many others, which span the same.
struct ReplacedColumns {
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd to_given;  ///< their coefficients of those of the others
};

/// Columns W of units of rows, piece by piece, in a sparse basis. Columns that change only from
/// block to block may separate as many blocks as there are columns; then each block has a column.
/// Work that is not linear in c then depends only on the columns of one block.
struct PiecewiseColumns {
  Eigen::Index count = 0;  ///< c
  std::vector<ColumnPiece> pieces;
  std::vector<ReplacedColumns> replaced;

  /// @return the coefficients b of W, of those in the basis.
  [[nodiscard]] Eigen::VectorXd estimate_of(Eigen::VectorXd in_basis) const;

  /// @return their covariance.
  [[nodiscard]] Eigen::MatrixXd covariance_of(Eigen::MatrixXd in_basis) const;
};

/// @param W     n m x c.
/// @param rows  m: of a unit.
/// @param kept  of the last columns: so many stay as they are.
[[nodiscard]] PiecewiseColumns piecewise_columns(const Eigen::MatrixXd& W,
                                                 Eigen::Index rows,
                                                 Eigen::Index kept);

}  // namespace axiscal
