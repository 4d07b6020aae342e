// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Consecutive rows, and the columns with a nonzero value in at least one of these rows.
struct ColumnPiece {
  Eigen::Index first = 0;  ///< index of its first row
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd W;  ///< rows x columns.size()
};

/// Columns that are replaced by the same number of columns with the same span.
struct ReplacedColumns {
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd to_given;  ///< maps coefficients of the new columns to those of the given columns
};

/// The columns W in a sparse basis, divided into pieces of consecutive rows. Columns that change
/// only between blocks of rows are replaced by one column for each block, if the number of blocks
/// equals the number of such columns. The work for a piece then depends only on the number of its
/// columns, not on c.
struct PiecewiseColumns {
  Eigen::Index count = 0;  ///< c, the number of columns of W
  std::vector<ColumnPiece> pieces;
  std::vector<ReplacedColumns> replaced;

  /// @return the coefficients b of W, from the coefficients in the basis.
  [[nodiscard]] Eigen::VectorXd estimate_of(Eigen::VectorXd in_basis) const;

  /// @return the covariance of b, from the covariance in the basis.
  [[nodiscard]] Eigen::MatrixXd covariance_of(Eigen::MatrixXd in_basis) const;
};

/// @param W     n m x c: m rows for each of n units.
/// @param rows  m, the number of rows of a unit.
/// @param kept  number of last columns that are not replaced.
[[nodiscard]] PiecewiseColumns piecewise_columns(const Eigen::MatrixXd& W,
                                                 Eigen::Index rows,
                                                 Eigen::Index kept);

}  // namespace axiscal
