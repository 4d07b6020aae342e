// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/product_of_size.hpp"
#include "axiscal/calib/scaled_cholesky.hpp"
#include "layings.hpp"

namespace axiscal {

/// What a fit with columns f_k^2, one for each axis, or without, comes to.
/// @tparam Axes  how many there are; Eigen::Dynamic: any number.
template <int Axes>
struct Bend {
  using OfAxes = Eigen::Matrix<double, Axes, 1>;
  OfAxes estimate;         // of the columns
  double squares = 0.0;    // weighted, those of errors that are shared among them
  OfAxes squares_of_axis;  // not weighted
};

/// Whether the axes' responses bend: an F test of the columns f_k^2. A bend swells the scatter of
/// its axis, so that the axes are weighed as they scatter with the columns, alike where they do not
/// differ then.
class BendTest {
 public:
  /// @param layings      of the readings; must outlive it.
  /// @param directions   whether the field's directions are fitted.
  /// @param columns      how many are fitted without those.
  /// @param variances    the axes' first: as they scatter without the columns.
  BendTest(const Layings& layings, bool directions, Eigen::Index columns, Eigen::VectorXd variances)
      : layings_(layings),
        directions_(directions),
        columns_(columns),
        variances_(std::move(variances)) {}

  [[nodiscard]] const Eigen::VectorXd& variances() const { return variances_; }

  /// @param fit  a Bend at the variances as they are then, nothing where the readings do not
  ///             determine it; called with whether the columns are in it.
  /// @param F    the field's length.
  template <typename Fit>
  [[nodiscard]] std::optional<CurvatureTest> by(const Fit& fit, double F) {
    auto after = fit(true);
    if (after && weigh_alike_if_equal(after->squares_of_axis)) {
      after = fit(true);
    }
    const auto before = after ? fit(false) : std::nullopt;
    if (!before || !after) {
      return std::nullopt;
    }
    const Eigen::Index m = layings_.set().axis_count();
    double squares = before->squares;
    double free = -static_cast<double>(columns_);
    for (Eigen::Index k = 0; k < m; ++k) {
      squares += layings_.squares(k) / variances_(k);
      free += readings_of(k);
    }
    const auto more = static_cast<double>(m);
    const double drop = std::max(before->squares - after->squares, 1e-12);
    if (!(free - more >= 1.0)) {
      return std::nullopt;
    }
    const double left = std::max(squares - drop, 1e-300);
    return CurvatureTest{
        .p_value = f_upper_p((drop / more) / (left / (free - more)), more, free - more),
        .bends = F * F * after->estimate};
  }

 private:
  // How many readings an axis has, those of a laying one by one.
  [[nodiscard]] double readings_of(Eigen::Index axis) const;

  // One variance for all axes, or in the stated ratio, where what a fit leaves of them does not
  // contradict that; returns whether it is so.
  // @param left  m sums of squares.
  bool weigh_alike_if_equal(const Eigen::Ref<const Eigen::VectorXd>& left);

  const Layings& layings_;
  bool directions_;
  Eigen::Index columns_;
  Eigen::VectorXd variances_;
};

/// Axes that share nothing but columns, so that each is known by its sums.
/// @tparam Shared  how many columns they share, the errors of inputs last among them, or
///                 Eigen::Dynamic; Axes likewise.
template <int Shared, int Axes>
class BentAxes {
 public:
  /// An axis's readings less what its own coefficients take up: the shared columns, and last its
  /// own column f_k^2.
  struct Axis {
    static constexpr int size = Shared == Eigen::Dynamic ? Eigen::Dynamic : Shared + 1;
    using OfColumns = Eigen::Matrix<double, size, 1>;
    Eigen::Matrix<double, size, size> information;
    OfColumns gradient;
    double squares = 0.0;
    OfColumns lengths;  // squared, of the columns as they are
  };

  /// @param errors  how many of the shared columns are inputs' errors, of variance 1.
  explicit BentAxes(Eigen::Index errors) : errors_(errors) {
    constexpr std::size_t mostly = 3;
    axes_.reserve(mostly);
  }

  /// @param P, y     what the axis's own columns leave of the others, f_k^2 the last of them, and
  ///                 of the readings.
  /// @param lengths  squared, of those columns as they are.
  template <typename Columns, typename Column, typename Lengths>
  void add(const Columns& P, const Column& y, const Lengths& lengths) {
    Axis& axis = axes_.emplace_back();
    axis.information = product_of_size<Shared>(P.transpose(), P);
    axis.gradient = product_of_size<Shared>(P.transpose(), y);
    axis.squares = y.squaredNorm();
    axis.lengths = lengths;
  }

  /// @return nothing where the readings do not determine it.
  [[nodiscard]] std::optional<Bend<Axes>> fit(const Eigen::VectorXd& variances, bool bent) const {
    constexpr int with = Shared == Eigen::Dynamic ? Eigen::Dynamic : Shared + Axes;
    return bent ? fit_columns<with, true>(variances) : fit_columns<Shared, false>(variances);
  }

 private:
  template <int Size, bool Bent>
  [[nodiscard]] std::optional<Bend<Axes>> fit_columns(const Eigen::VectorXd& variances) const {
    const auto m = static_cast<Eigen::Index>(axes_.size());
    const Eigen::Index shared = axes_.front().gradient.size() - 1;
    Bend<Axes> bend{.estimate = Bend<Axes>::OfAxes::Zero(m),
                    .squares_of_axis = typename Bend<Axes>::OfAxes(m)};
    for (Eigen::Index k = 0; k < m; ++k) {
      bend.squares_of_axis(k) = axes_[static_cast<std::size_t>(k)].squares;
      bend.squares += bend.squares_of_axis(k) / variances(k);
    }
    if constexpr (Size != 0) {
      Eigen::Matrix<double, Size, 1> right;
      const std::optional<Eigen::Matrix<double, Size, 1>> estimate =
          solved<Size, Bent>(variances, right);
      if (!estimate) {
        return std::nullopt;
      }
      bend.squares -= estimate->dot(right);
      for (Eigen::Index k = 0; k < m; ++k) {
        const Axis& axis = axes_[static_cast<std::size_t>(k)];
        typename Axis::OfColumns own(shared + 1);
        for (Eigen::Index j = 0; j < shared; ++j) {
          own(j) = (*estimate)(j);
        }
        own(shared) = Bent ? (*estimate)(shared + k) : 0.0;
        bend.estimate(k) = own(shared);
        bend.squares_of_axis(k) = std::max(
            axis.squares - 2.0 * own.dot(axis.gradient) + own.dot(axis.information * own), 0.0);
      }
    }
    return bend;
  }

  // By the normal equations; on return their right side.
  template <int Size, bool Bent>
  [[nodiscard]] std::optional<Eigen::Matrix<double, Size, 1>> solved(
      const Eigen::VectorXd& variances, Eigen::Matrix<double, Size, 1>& right) const {
    using Square = Eigen::Matrix<double, Size, Size>;
    using OfColumns = Eigen::Matrix<double, Size, 1>;
    const auto m = static_cast<Eigen::Index>(axes_.size());
    const Eigen::Index shared = axes_.front().gradient.size() - 1;
    const Eigen::Index size = shared + (Bent ? m : 0);
    Square normal = Square::Zero(size, size);
    OfColumns lengths = OfColumns::Zero(size);
    right = OfColumns::Zero(size);
    for (Eigen::Index e = shared - errors_; e < shared; ++e) {
      normal(e, e) = 1.0;
    }
    for (Eigen::Index k = 0; k < m; ++k) {
      const Axis& axis = axes_[static_cast<std::size_t>(k)];
      const double weight = 1.0 / variances(k);
      const auto place = [&](Eigen::Index j) { return j < shared ? j : shared + k; };
      for (Eigen::Index j = 0; j < shared + (Bent ? 1 : 0); ++j) {
        right(place(j)) += weight * axis.gradient(j);
        lengths(place(j)) += weight * axis.lengths(j);
        for (Eigen::Index i = 0; i < shared + (Bent ? 1 : 0); ++i) {
          normal(place(i), place(j)) += weight * axis.information(i, j);
        }
      }
    }
    if (size == 0) {
      return OfColumns(size);
    }
    constexpr double open_below = 1e-13;
    const ScaledCholeskyOf<Square> cholesky(normal);
    if (!cholesky.is_determined(open_below) ||
        !(normal.diagonal().array() > open_below * lengths.array()).all()) {
      return std::nullopt;
    }
    return cholesky.solve(right);
  }

  Eigen::Index errors_;
  std::vector<Axis> axes_;
};

}  // namespace axiscal
