// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/least_squares.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// The regression of one axis's readings on its columns: a constant, the components of the field,
/// and further terms.
struct AxisRegression {
  LeastSquaresFit fit;
  Eigen::VectorXd variance_inflation;  // variance inflation factor of each column
  double condition_number = 1.0;
  Eigen::VectorXd weights;         // weights without the robust weights
  Eigen::VectorXd robust_weights;  // empty if the fit is not robust
};

/// The rows of a regression, and their groups of repeats.
struct RegressionRows {
  std::vector<RegressionRow> rows;  // summarize() fills in the diagnostics of these rows
  std::vector<int> group;           // group number of each row; the rows of a group are repeats
  // Number of each row's series. A series contains the consecutive readings at one design point. If
  // the vector is empty, each row is a series of its own.
  std::vector<int> laying;
};

/// Axes of a set that have the same design and weights, and therefore share a factorisation.
struct AxesAlike {
  const ReadingSet& set;
  Eigen::Index first = 0;                       ///< index of the first axis in the set
  const FactoredDesign& factored;               ///< factorisation of the weighted design
  const Eigen::MatrixXd& design;                ///< n x p
  Eigen::VectorXd weights;                      ///< n
  Eigen::Ref<const Eigen::MatrixXd> responses;  ///< n x r
  /// returns the parameter names of an axis, for error messages
  std::function<std::vector<std::string>(Eigen::Index axis)> names;
};

/// Fits each axis by weighted least squares, or robustly if the set asks for it.
/// @return one regression for each axis.
[[nodiscard]] std::vector<AxisRegression> regress(const AxesAlike& axes);

/// @throws RefusedError  if there are too few degrees of freedom for robust regression to detect a
///                       wrong reading.
void require_robust_freedom(double degrees_of_freedom);

/// Returns R^2 = 1 - RSS / TSS. RSS is the sum of squares of the weighted residuals. TSS is the
/// weighted sum of squares of the response about its weighted mean.
[[nodiscard]] double r_squared_about_mean(const Eigen::VectorXd& response,
                                          const Eigen::VectorXd& weights,
                                          const Eigen::VectorXd& weighted_residuals);

/// Tests one axis for lack of fit: compares the scatter of the groups about the model with the pure
/// error. Pure error is the scatter within a group. It is computed from the means over consecutive
/// readings at one design point, because such readings share the error of the cube's seat.
/// @param weighted_residuals  sqrt(w_i) (y_i - fit_i).
/// @param effects             number of columns for shifts of blocks, a step, a drift and a memory.
///                            These columns differ between repeats, so their degrees of freedom are
///                            subtracted from those of the pure error.
/// @param robust_weights      empty if the fit is not robust; a reading of weight 0 is ignored.
/// @return F and p are NaN if the lack of fit or the pure error has no degrees of freedom.
[[nodiscard]] LackOfFit test_lack_of_fit(const RegressionRows& rows,
                                         const Eigen::VectorXd& weights,
                                         const Eigen::VectorXd& weighted_residuals,
                                         double degrees_of_freedom,
                                         double rounding,
                                         Eigen::Index effects,
                                         const Eigen::VectorXd& robust_weights = {});

/// Returns statistics in which only the rows and the numbers of observations are filled in.
[[nodiscard]] FitStatistics blank_statistics(const ReadingSet& set, RegressionRows& rows);

/// Stores the diagnostics of axis k in the statistics.
void put_diagnostics(FitStatistics& statistics,
                     Eigen::Index k,
                     const Eigen::VectorXd& leverage,
                     const ResidualDiagnostics& diagnostics,
                     const Eigen::VectorXd& robust_weights);

/// Throws if all readings of an axis are equal, because the axis then does not respond to the
/// field.
/// @throws RefusedError  The message names the axis.
void require_response(const ReadingSet& set);

/// Combines the axes' regressions into the response and its statistics.
[[nodiscard]] Estimate summarize(const ReadingSet& set,
                                 const std::vector<AxisRegression>& axes,
                                 RegressionRows rows);

/// Returns the group number of each of the n readings. The readings of a group have the same level
/// and temperature. They also have the same stated field or, if no field is stated, the same design
/// point.
[[nodiscard]] std::vector<int> groups_of_readings(const ReadingSet& set);

/// @return the rows of the regression, with the numbers of groups_of_readings().
[[nodiscard]] RegressionRows rows_of_readings(const ReadingSet& set);

}  // namespace axiscal
