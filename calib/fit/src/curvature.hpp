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

/// The result of a fit with columns f_k^2, one for each axis k, or without them. f_k is the field
/// along axis k.
struct CurvatureFit {
  Eigen::VectorXd estimate;         // coefficients of the columns f_k^2
  double squares = 0.0;             // weighted sum of squares of the residuals and of shared errors
  Eigen::VectorXd squares_of_axis;  // sum of squares of each of the m axes, not weighted
};

/// Tests whether the axes' responses are curved, by an F test of the columns f_k^2. The fits use
/// the variances given to the constructor, with one exception: if a ratio of the variances is
/// stated, or if the residuals agree with equal variances of all axes, the variances are estimated
/// from all axes together, unless seats are fitted. This estimate comes from the fit with the
/// columns f_k^2, because a curved response would increase the residuals of the fit without them.
class CurvatureFTest {
 public:
  /// @param layings      means of layings or of poses; must outlive this object.
  /// @param directions   true if the field's directions are fitted.
  /// @param columns      number of fitted columns without the columns f_k^2.
  /// @param variances    variances of the m axes, then of the seats if they are fitted, from the
  ///                     fit without the columns f_k^2.
  CurvatureFTest(const MeanReadings& layings,
                 bool directions,
                 Eigen::Index columns,
                 Eigen::VectorXd variances)
      : layings_(layings),
        directions_(directions),
        columns_(columns),
        variances_(std::move(variances)),
        within_(layings.squares),
        freedom_within_(layings.degrees_of_freedom) {}

  [[nodiscard]] const Eigen::VectorXd& variances() const { return variances_; }

  /// @param fit  function that returns a CurvatureFit at the present variances, or nullopt if the
  ///             readings do not determine it. Its argument is true to include the columns f_k^2.
  /// @param F    magnitude of the field.
  template <typename Fit>
  [[nodiscard]] std::optional<CurvatureTest> by(const Fit& fit, double F) {
    auto after = fit(true);
    if (after) {
      count_means_if_they_share_errors(after->squares_of_axis);
    }
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
      squares += within_(k) / variances_(k);
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
  [[nodiscard]] bool seats_are_fitted() const {
    return variances_.size() > layings_.set().axis_count();
  }

  // Returns the number of independent readings of an axis. It is the number of means plus the
  // degrees of freedom of the readings about their means.
  [[nodiscard]] double readings_of(Eigen::Index axis) const;

  // Returns the degrees of freedom that each axis loses to its own columns, to the column f_k^2,
  // and to its share of the two parameters of the field's direction.
  [[nodiscard]] double taken() const;

  // Leaves the scatter of the readings about their means out if the means scatter clearly more:
  // the readings of a laying then share an error, and only the means are independent.
  // @param left  m residual sums of squares of the means.
  void count_means_if_they_share_errors(const Eigen::Ref<const Eigen::VectorXd>& left);

  // Sets one variance for all axes, or variances in the stated ratio, if the residuals are
  // consistent with such variances. Returns true if the variances were set.
  // @param left  m residual sums of squares.
  bool pool_variances_if_equal(const Eigen::Ref<const Eigen::VectorXd>& left);

  const MeanReadings& layings_;
  bool directions_;
  Eigen::Index columns_;
  Eigen::VectorXd variances_;
  Eigen::VectorXd within_;          // m: sum of squares of the readings about their means
  Eigen::VectorXd freedom_within_;  // m: degrees of freedom of `within_`
};

/// The fits for CurvatureFTest if the axes share no random errors such as those of seats. Sums over
/// the readings of each axis are then sufficient, even if the axes share columns.
class IndependentCurvature {
 public:
  /// Sums of products over the readings of one axis. The columns are the shared ones, then f_k^2 of
  /// this axis. All are made orthogonal to the columns that only this axis has.
  struct Axis {
    Eigen::MatrixXd information;
    Eigen::VectorXd gradient;
    double squares = 0.0;
    Eigen::VectorXd lengths;  // squared norms of the columns before they are made orthogonal
  };

  /// @param errors  number of input errors. Their columns are the last ones of the shared columns;
  ///                their coefficients have the variance 1.
  explicit IndependentCurvature(Eigen::Index errors) : errors_(errors) {}

  /// Adds an axis.
  /// @param P        the shared columns, then f_k^2, orthogonal to the axis's own columns.
  /// @param y        the readings, orthogonal to the axis's own columns.
  /// @param lengths  squared norms of the columns of P before they were made orthogonal.
  void add(const Eigen::MatrixXd& P, const Eigen::VectorXd& y, const Eigen::VectorXd& lengths) {
    axes_.push_back({.information = P.transpose() * P,
                     .gradient = P.transpose() * y,
                     .squares = y.squaredNorm(),
                     .lengths = lengths});
  }

  /// @param bent  true to include the columns f_k^2.
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
