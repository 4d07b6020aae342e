// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "axiscal/calib/deletion_fit.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/fixed_cholesky.hpp"
#include "axiscal/calib/rough_tails.hpp"
#include "axiscal/calib/shared_fit.hpp"

namespace axiscal {
namespace {

// A^-1 of a small A; nothing where it is not clearly positive definite.
template <typename Square>
std::optional<Square> inverse_of(const Square& A, double open_below) {
  if constexpr (Square::RowsAtCompileTime != Eigen::Dynamic) {
    const FixedCholesky<Square::RowsAtCompileTime> cholesky(A);
    if (!cholesky.is_positive() ||
        !(cholesky.factor().diagonal().array().square() > open_below).all()) {
      return std::nullopt;
    }
    const Square root = cholesky.inverse_of_factor();
    return root.transpose().lazyProduct(root);
  } else {
    const Eigen::LLT<Square> cholesky(A);
    if (cholesky.info() != Eigen::Success ||
        !(cholesky.matrixLLT().diagonal().array().square() > open_below).all()) {
      return std::nullopt;
    }
    return cholesky.solve(Square::Identity(A.rows(), A.rows()));
  }
}

}  // namespace

// As without() and left_out() have it, which are for any run: written for sizes that the compiler
// knows, it takes a sixth of their time, and levelness asks it of each face (small_run_test.cpp
// holds the two together).
// @param roughly  as rough_p_value() has it, of one contrast.
template <int Count, int ContrastCount>
std::optional<double> DeletionFit::p_value_of_small(const std::vector<std::size_t>& readings,
                                                    const Eigen::MatrixXd& contrasts,
                                                    bool roughly) const {
  constexpr int most = Count == Eigen::Dynamic ? few : Count;
  constexpr int most_contrasts = ContrastCount == Eigen::Dynamic ? few : ContrastCount;
  using Square = Eigen::Matrix<double, Count, Count, 0, most, most>;
  constexpr int order = most_contrasts == 1 ? Eigen::RowMajor : Eigen::ColMajor;
  using Contrasts = Eigen::Matrix<double, ContrastCount, Count, order, most_contrasts, most>;
  using OfContrasts = Eigen::Matrix<double, ContrastCount, 1, 0, most_contrasts, 1>;
  using AmongContrasts =
      Eigen::Matrix<double, ContrastCount, ContrastCount, 0, most_contrasts, most_contrasts>;
  const auto d = static_cast<Eigen::Index>(readings.size());
  Eigen::Matrix<double, Count, 4, 0, most, 4> Q(d, 4);
  Eigen::Matrix<double, Count, 3, 0, most, 3> gone(d, 3);
  Eigen::Matrix<double, Count, 6, 0, most, 6> shared(d, 6);
  Eigen::Matrix<double, 1, 6> squares_of_tangents = Eigen::Matrix<double, 1, 6>::Zero();
  for (Eigen::Index i = 0; i < d; ++i) {
    const auto row = static_cast<Eigen::Index>(readings[static_cast<std::size_t>(i)]);
    Q.row(i) = small_->basis().row(row);
    gone.row(i) = small_->residuals().row(row);
    shared.row(i) = small_->projected().row(row);
    squares_of_tangents += small_->tangents().row(row).cwiseAbs2();
  }
  const std::optional<Square> K =
      inverse_of<Square>(Square::Identity(d, d) - Q.lazyProduct(Q.transpose()), open_below);
  if (!K) {
    return std::nullopt;
  }
  const decltype(gone) errors = K->lazyProduct(gone);
  const decltype(shared) changes = K->lazyProduct(shared);
  DirectionFit fit{.covariance = Eigen::Matrix2d::Zero()};
  fit.estimate.setZero();
  std::array<DirectionSums, 3> sums;
  Eigen::Vector3d start;
  Eigen::RowVector2d all = Eigen::RowVector2d::Zero();
  Eigen::RowVector2d left = Eigen::RowVector2d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const ResponseSums& of_all = axis_of(k).sums;
    DirectionSums& own = sums[static_cast<std::size_t>(k)];
    own.squares = std::max(of_all.squares - gone.col(k).dot(errors.col(k)), 0.0);
    own.degrees_of_freedom = of_all.degrees_of_freedom - static_cast<double>(d);
    // Axes that scatter alike have like parts of the directions.
    const double part = small_->has_directions() ? 2.0 / 3.0 : 0.0;
    start(k) = std::max(own.squares / std::max(own.degrees_of_freedom - part, 1.0),
                        std::max(smallest_(k), std::numeric_limits<double>::min()));
    if (small_->has_directions()) {
      const auto P = shared.template middleCols<2>(2 * k).transpose();
      own.information = of_all.information - P.lazyProduct(changes.template middleCols<2>(2 * k));
      own.gradient = of_all.gradient - P.lazyProduct(errors.col(k));
      all += (axis_of(k).tangent_squares.transpose() -
              squares_of_tangents.template segment<2>(2 * k)) /
             start(k);
      left += own.information.diagonal().transpose() / start(k);
    }
  }
  if (small_->has_directions()) {
    if (!(left.array() > open_below * all.array()).all()) {
      return std::nullopt;
    }
    const std::optional<DirectionFit> together =
        roughly ? fit_shared_roughly(sums, start, smallest_) : fit_shared(sums, start, smallest_);
    if (!together) {
      return std::nullopt;
    }
    fit = *together;
  } else {
    for (Eigen::Index k = 0; k < 3; ++k) {
      const DirectionSums& own = sums[static_cast<std::size_t>(k)];
      fit.degrees_of_freedom(k) = own.degrees_of_freedom;
      fit.variance(k) = std::max(own.squares / own.degrees_of_freedom, smallest_(k));
    }
  }
  const double fewest = roughly ? 1.0 : 0.5;  // of which the rough tails are known
  if (!(fit.degrees_of_freedom.minCoeff() > fewest)) {
    return std::nullopt;
  }
  const Contrasts C = contrasts;
  const AmongContrasts unscaled = C.lazyProduct(K->lazyProduct(C.transpose()));
  const auto q = static_cast<double>(C.rows());
  FisherSum axes;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Matrix<double, ContrastCount, 2, order, most_contrasts, 2> by_shared =
        C.lazyProduct(changes.template middleCols<2>(2 * k));
    const OfContrasts error = C.lazyProduct(errors.col(k)) - by_shared.lazyProduct(fit.estimate);
    const AmongContrasts covariance =
        fit.variance(k) * unscaled +
        by_shared.lazyProduct(fit.covariance.lazyProduct(by_shared.transpose()));
    double squares = 0.0;
    if (C.rows() > 1) {
      squares = error.dot(covariance.ldlt().solve(error));
    } else if (covariance(0, 0) > 0.0) {
      squares = error(0) * error(0) / covariance(0, 0);
    }
    const double nu = fit.degrees_of_freedom(k);
    axes.add(roughly ? t_two_sided_p_roughly(squares, nu)
                     : f_upper_p(std::max(squares / q, 1e-12), q, nu));
  }
  return axes.p_value();
}

template std::optional<double> DeletionFit::p_value_of_small<2, 1>(const std::vector<std::size_t>&,
                                                                   const Eigen::MatrixXd&,
                                                                   bool) const;
template std::optional<double> DeletionFit::p_value_of_small<Eigen::Dynamic, Eigen::Dynamic>(
    const std::vector<std::size_t>&, const Eigen::MatrixXd&, bool) const;

}  // namespace axiscal
