// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/distributions.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/layings.hpp"

namespace axiscal {

/// The result of a fit with columns f_k^2, one for each axis, or without them.
struct CurvatureFit {
  Eigen::VectorXd estimate;         // coefficients of the columns f_k^2
  double squares = 0.0;             // weighted sum of squares, including those of shared errors
  Eigen::VectorXd squares_of_axis;  // m sums of squares, not weighted
};

/// Tests whether the axes' responses bend, by an F test of the columns f_k^2. The fits use the
/// variances given to the constructor, unless the residuals agree with equal variances of all axes
/// or a ratio of the variances is stated. The variances are then pooled, with the residuals of the
/// fit that includes the columns, because a bend increases the residuals of the other fit.
class CurvatureFTest {
 public:
  /// @param layings      the layings of the readings; must outlive this object.
  /// @param directions   true if the field's directions are fitted.
  /// @param columns      number of fitted columns without the columns f_k^2.
  /// @param variances    variances of the m axes, then of the seats if they are fitted, from the
  ///                     fit without the columns f_k^2.
  CurvatureFTest(const Layings& layings,
                 bool directions,
                 Eigen::Index columns,
                 Eigen::VectorXd variances)
      : layings_(layings),
        directions_(directions),
        columns_(columns),
        variances_(std::move(variances)) {}

  [[nodiscard]] const Eigen::VectorXd& variances() const { return variances_; }

  /// @param fit  function that returns a CurvatureFit at the present variances, or nullopt if the
  ///             readings do not determine it. Its argument is true to include the columns f_k^2.
  /// @param F    the field's length.
  template <typename Fit>
  [[nodiscard]] std::optional<CurvatureTest> by(const Fit& fit, double F) {
    auto after = fit(true);
    if (after && pool_variances_if_equal(after->squares_of_axis)) {
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
  // The number of readings of an axis; each reading of a laying counts.
  [[nodiscard]] double readings_of(Eigen::Index axis) const;

  // Sets one variance for all axes, or variances in the stated ratio, if the residuals do not
  // contradict this. Returns true if the variances were set.
  // @param left  m residual sums of squares.
  bool pool_variances_if_equal(const Eigen::Ref<const Eigen::VectorXd>& left);

  const Layings& layings_;
  bool directions_;
  Eigen::Index columns_;
  Eigen::VectorXd variances_;
};

/// The fit of CurvatureFTest if the axes share columns, but no random errors such as seats. Sums
/// over each axis are then sufficient.
class IndependentCurvature {
 public:
  /// Sums of products over the readings of an axis, after projection off its own columns. The
  /// columns are the shared ones, then the axis's column f_k^2.
  struct Axis {
    Eigen::MatrixXd information;
    Eigen::VectorXd gradient;
    double squares = 0.0;
    Eigen::VectorXd lengths;  // squared lengths of the columns before projection
  };

  /// @param errors  number of shared columns that are errors of inputs with variance 1.
  explicit IndependentCurvature(Eigen::Index errors) : errors_(errors) {}

  /// Adds an axis.
  /// @param P, y     the shared columns with f_k^2 as the last one, and the readings; both after
  ///                 projection off the axis's own columns.
  /// @param lengths  squared lengths of these columns before projection.
  void add(const Eigen::MatrixXd& P, const Eigen::VectorXd& y, const Eigen::VectorXd& lengths) {
    axes_.push_back({.information = P.transpose() * P,
                     .gradient = P.transpose() * y,
                     .squares = y.squaredNorm(),
                     .lengths = lengths});
  }

  /// @return nullopt if the readings do not determine the fit.
  [[nodiscard]] std::optional<CurvatureFit> fit(const Eigen::VectorXd& variances, bool bent) const;

 private:
  [[nodiscard]] std::optional<Eigen::VectorXd> solved(const Eigen::VectorXd& variances,
                                                      bool bent,
                                                      Eigen::VectorXd& right) const;

  Eigen::Index errors_;
  std::vector<Axis> axes_;
};

}  // namespace axiscal
