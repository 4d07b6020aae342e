// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/least_squares.hpp"

namespace axiscal {

/// The regression of one axis's response on [1, f, second fields].
struct AxisRegression {
  LeastSquaresFit fit;
  Eigen::VectorXd variance_inflation;  // one for each column
  double condition_number = 1.0;
  Eigen::VectorXd weights;         // as given
  Eigen::VectorXd robust_weights;  // empty unless robust
};

/// Rows that go into the regression, and which of them repeat each other.
struct RegressionRows {
  std::vector<RegressionRow> rows;  // their diagnostics are filled in by summarize()
  std::vector<int> group;           // rows of one number are replicates
};

/// Fits axis after axis: those of the same columns and weights share one factorisation.
class AxisRegressor {
 public:
  /// @param robust  whether by bisquare.
  explicit AxisRegressor(bool robust) : robust_(robust) {}

  /// @param names     of the axis's parameters, for errors.
  /// @param rounding  residuals below this count as zero.
  /// @param given     the design factored with those weights, where it is.
  [[nodiscard]] AxisRegression fit(const Eigen::MatrixXd& design,
                                   const Eigen::VectorXd& response,
                                   const Eigen::VectorXd& weights,
                                   const DesignNames& names,
                                   double rounding,
                                   const FactoredDesign* given = nullptr);

 private:
  struct Factored {
    Eigen::MatrixXd columns;
    Eigen::VectorXd weights;
    LeastSquaresDesign design;
    Eigen::VectorXd variance_inflation;
    double condition_number = 1.0;
  };

  bool robust_;
  std::optional<Factored> last_;
};

/// 1 - RSS / total sum of squares about the weighted mean.
[[nodiscard]] double r_squared_about_mean(const Eigen::VectorXd& response,
                                          const Eigen::VectorXd& weights,
                                          const Eigen::VectorXd& weighted_residuals);

/// Pure error against lack of fit for one axis.
/// @param weighted_residuals  sqrt(w_i) (y_i - fit_i).
/// @param effects             columns of the run's effects, which differ between repeats and so
///                            take their degrees of freedom from the pure error.
/// @return F and p are NaN where there are no degrees of freedom for either part.
[[nodiscard]] LackOfFit test_lack_of_fit(const std::vector<int>& group,
                                         const Eigen::VectorXd& weights,
                                         const Eigen::VectorXd& weighted_residuals,
                                         double degrees_of_freedom,
                                         double rounding,
                                         Eigen::Index effects);

/// Statistics with room for each axis, and no more in them than the rows.
[[nodiscard]] FitStatistics blank_statistics(const ReadingSet& set, RegressionRows& rows);

/// Writes what was found of axis k into the rows' diagnostics.
void put_diagnostics(FitStatistics& statistics,
                     Eigen::Index k,
                     const Eigen::VectorXd& leverage,
                     const ResidualDiagnostics& diagnostics,
                     const Eigen::VectorXd& robust_weights);

/// Refuses an axis whose readings are all the same: it does not respond to the field.
/// @throws RefusedError  naming the axis.
void require_response(const ReadingSet& set);

/// Puts the axes' regressions together into the response and its statistics.
[[nodiscard]] Estimate summarize(const ReadingSet& set,
                                 const std::vector<AxisRegression>& axes,
                                 RegressionRows rows);

/// Numbers readings by what they were taken at: same design point and level, or same field; n.
[[nodiscard]] std::vector<int> groups_of_readings(const ReadingSet& set);

/// @return the rows of the regression, with those numbers.
[[nodiscard]] RegressionRows rows_of_readings(const ReadingSet& set);

}  // namespace axiscal
