// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/piecewise_columns.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

// The smallest number of units in a piece; a unit is a group of consecutive rows of the matrix.
// Smaller pieces cost more time than they save.
constexpr Eigen::Index fewest_units = 8;

using Which = Eigen::Array<bool, 1, Eigen::Dynamic>;

std::vector<Eigen::Index> places_in(const Which& which) {
  std::vector<Eigen::Index> places;
  for (Eigen::Index j = 0; j < which.size(); ++j) {
    if (which(j)) {
      places.push_back(j);
    }
  }
  return places;
}

// Row k of each unit in which this row is not zero. A unit is a group of consecutive rows of the
// whole matrix. `places` contains the indices of these rows in the whole matrix, and W contains
// their values in selected columns.
struct RowsOfUnits {
  std::vector<Eigen::Index> places;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> W;
};

RowsOfUnits telling_rows(const Eigen::MatrixXd& W,
                         Eigen::Index rows,
                         Eigen::Index k,
                         const std::vector<Eigen::Index>& columns) {
  const Eigen::Array<bool, Eigen::Dynamic, 1> tells =
      (W(Eigen::seq(k, Eigen::last, rows), Eigen::all).array() != 0.0).rowwise().any();
  RowsOfUnits own;
  for (Eigen::Index i = 0; i < tells.size(); ++i) {
    if (tells(i)) {
      own.places.push_back(rows * i + k);
    }
  }
  own.W = W(own.places, columns);
  return own;
}

// Returns the columns that are nonzero only in row k of the units. The last `kept` columns are not
// included.
std::vector<Eigen::Index> columns_of_row(const Eigen::MatrixXd& W,
                                         Eigen::Index rows,
                                         Eigen::Index k,
                                         Eigen::Index kept) {
  Which own = Which::Constant(W.cols(), true);
  own.tail(kept).setConstant(false);
  for (Eigen::Index other = 0; other < rows; ++other) {
    if (other != k) {
      own = own &&
            (W(Eigen::seq(other, Eigen::last, rows), Eigen::all).array() == 0.0).colwise().all();
    }
  }
  return places_in(own);
}

// Returns the columns that rarely change from unit to unit: on average, at most once in
// fewest_units units.
std::vector<Eigen::Index> slow_columns(const RowsOfUnits& own) {
  const Eigen::Index changes = own.W.rows() - 1;
  return places_in(((own.W.bottomRows(changes).array() != own.W.topRows(changes).array())
                        .cast<Eigen::Index>()
                        .colwise()
                        .sum() *
                    fewest_units) <= own.W.rows());
}

// Blocks of rows in which the slow columns are constant. `values` contains the values of the slow
// columns in each block, and `of_row` the index of each row's block. The search for blocks stops
// if there are more blocks than columns.
struct Blocks {
  std::vector<Eigen::RowVectorXd> values;
  std::vector<std::size_t> of_row;
};

Blocks blocks_of(const Eigen::MatrixXd& slow) {
  const auto most = static_cast<std::size_t>(slow.cols());
  Blocks blocks;
  for (Eigen::Index i = 0; i < slow.rows() && blocks.values.size() <= most; ++i) {
    const Eigen::RowVectorXd values = slow.row(i);
    const bool stays = !blocks.of_row.empty() && values == blocks.values[blocks.of_row.back()];
    const auto found =
        stays ? blocks.values.begin() + static_cast<std::ptrdiff_t>(blocks.of_row.back())
              : std::find(blocks.values.begin(), blocks.values.end(), values);
    blocks.of_row.push_back(static_cast<std::size_t>(found - blocks.values.begin()));
    if (found == blocks.values.end()) {
      blocks.values.push_back(values);
    }
  }
  return blocks;
}

// Replaces the slow columns, which are nonzero only in row k of the units, by one column for each
// block. Returns nullopt if few units have a nonzero row k, or if the number of blocks differs from
// the number of slow columns.
std::optional<ReplacedColumns> part_blocks(Eigen::Index rows,
                                           Eigen::Index k,
                                           Eigen::Index kept,
                                           Eigen::MatrixXd& W) {
  const std::vector<Eigen::Index> columns = columns_of_row(W, rows, k, kept);
  const RowsOfUnits own = telling_rows(W, rows, k, columns);
  if (own.W.rows() < 2 * fewest_units) {
    return std::nullopt;
  }
  const std::vector<Eigen::Index> slow = slow_columns(own);
  const Blocks blocks = blocks_of(own.W(Eigen::all, slow));
  if (slow.size() < 2 || blocks.values.size() != slow.size()) {
    return std::nullopt;
  }
  const auto count = static_cast<Eigen::Index>(slow.size());
  Eigen::MatrixXd values(count, count);
  for (Eigen::Index b = 0; b < count; ++b) {
    values.row(b) = blocks.values[static_cast<std::size_t>(b)];
  }
  const Eigen::MatrixXd inverse = inverse_of(values);
  constexpr double nearly_dependent = 1e-6;
  if (!(nearly_dependent * values.norm() * inverse.norm() < 1.0)) {
    return std::nullopt;
  }
  ReplacedColumns replaced{.columns = {}, .to_given = inverse};
  for (const Eigen::Index j : slow) {
    replaced.columns.push_back(columns[static_cast<std::size_t>(j)]);
  }
  W(own.places, replaced.columns).setZero();
  for (std::size_t i = 0; i < own.places.size(); ++i) {
    W(own.places[i], replaced.columns[blocks.of_row[i]]) = 1.0;
  }
  return replaced;
}

// Divides the rows into pieces of units (groups of consecutive rows). A new piece begins if two
// conditions are met: the current piece has at least fewest_units units, and the next unit is
// nonzero in a column in which all units of the current piece are zero.
std::vector<ColumnPiece> pieces_of(const Eigen::MatrixXd& W, Eigen::Index rows) {
  std::vector<ColumnPiece> pieces;
  Which used = Which::Constant(W.cols(), false);
  const auto close = [&](Eigen::Index end) {
    ColumnPiece& piece = pieces.back();
    piece.columns = places_in(used);
    piece.W = W.middleRows(piece.first, end - piece.first)(Eigen::all, piece.columns);
  };
  for (Eigen::Index first = 0; first < W.rows(); first += rows) {
    const Which own = (W.middleRows(first, rows).array() != 0.0).colwise().any();
    const bool is_full = !pieces.empty() && first - pieces.back().first >= fewest_units * rows;
    if (pieces.empty() || (is_full && (own && !used).any())) {
      if (!pieces.empty()) {
        close(first);
      }
      pieces.push_back({.first = first});
      used = own;
    } else {
      used = used || own;
    }
  }
  if (!pieces.empty()) {
    close(W.rows());
  }
  return pieces;
}

}  // namespace

Eigen::VectorXd PiecewiseColumns::estimate_of(Eigen::VectorXd in_basis) const {
  for (const auto& [columns, to_given] : replaced) {
    const Eigen::VectorXd own = to_given * in_basis(columns);
    in_basis(columns) = own;
  }
  return in_basis;
}

Eigen::MatrixXd PiecewiseColumns::covariance_of(Eigen::MatrixXd in_basis) const {
  for (const auto& [columns, to_given] : replaced) {
    const Eigen::MatrixXd rows = to_given * in_basis(columns, Eigen::all);
    in_basis(columns, Eigen::all) = rows;
    const Eigen::MatrixXd own = in_basis(Eigen::all, columns) * to_given.transpose();
    in_basis(Eigen::all, columns) = own;
  }
  return in_basis;
}

PiecewiseColumns piecewise_columns(const Eigen::MatrixXd& W, Eigen::Index rows, Eigen::Index kept) {
  PiecewiseColumns all{.count = W.cols()};
  Eigen::MatrixXd in_basis = W;
  for (Eigen::Index k = 0; k < rows; ++k) {
    if (std::optional<ReplacedColumns> replaced = part_blocks(rows, k, kept, in_basis)) {
      all.replaced.push_back(*std::move(replaced));
    }
  }
  all.pieces = pieces_of(in_basis, rows);
  return all;
}

}  // namespace axiscal
