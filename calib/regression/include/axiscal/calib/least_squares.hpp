// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The result of a linear regression of one response; n observations, p parameters.
///
/// The errors of the observations are taken as independent, with the variances sigma^2 / w_i. If
/// n = p, the fit passes through the observations and sigma is unknown: the covariance,
/// residual_sd and the studentised residuals are then NaN.
struct LeastSquaresFit {
  Eigen::VectorXd estimate;         ///< b, p entries [unit of y / unit of the column]
  Eigen::MatrixXd covariance;       ///< s^2 (X^T W X)^-1, p x p
  Eigen::VectorXd residuals;        ///< y - X b, n entries [unit of y], not weighted
  double degrees_of_freedom = 0.0;  ///< number of observations of non-zero weight, minus p
  double residual_sd = 0.0;         ///< s, the sd of an observation of weight 1 [unit of y]
  /// R^2. If a linear combination of the columns is constant, the residuals are compared with the
  /// deviations of y from its mean, otherwise with y itself.
  double r_squared = 0.0;
  Eigen::VectorXd leverage;        ///< diagonal of the hat matrix, n entries in 0 .. 1
  Eigen::VectorXd studentized;     ///< externally studentised residuals; NaN if undefined
  Eigen::VectorXd cooks_distance;  ///< Cook's distance of each observation; NaN if undefined
};

/// Fits `y = X b + e` by least squares, with independent errors of one variance.
///
/// @code
/// Eigen::MatrixXd X(4, 2);                                 // a line: constant and slope
/// X << 1, 0, 1, 1, 1, 2, 1, 3;
/// const axiscal::LeastSquaresFit line =
///     axiscal::fit_least_squares(X, Eigen::Vector4d(0.1, 1.9, 4.1, 5.9));
/// const double slope = line.estimate(1);                   // 1.96
/// const double its_u = std::sqrt(line.covariance(1, 1));   // standard uncertainty
/// @endcode
///
/// The function throws an error if the columns of X are dependent, because the observations then do
/// not determine every parameter. The error names the undetermined parameters. Use
/// LeastSquaresDesign for weights, for names of the parameters, or for several responses of one
/// design.
///
/// @param design        X, n x p with n >= p; column j in [unit of y / unit of b_j].
/// @param observations  y, n entries in one unit.
/// @throws DomainError         if the sizes disagree, or an entry is not finite.
/// @throws RankDeficientError  if the columns are dependent to working precision.
[[nodiscard]] AXISCAL_EXPORT LeastSquaresFit
fit_least_squares(const Eigen::Ref<const Eigen::MatrixXd>& design,
                  const Eigen::Ref<const Eigen::VectorXd>& observations);

/// A function that returns the names of a design's parameters; it is called only for an error.
using DesignNames = std::function<std::vector<std::string>()>;

/// The design of a linear regression `y = X b + e`, factored once for any number of responses. It
/// computes only estimates. LeastSquaresDesign also computes the statistics of a fit.
///
/// The decomposition is W^1/2 X D P = Q R, by Householder QR with column pivoting. D scales the
/// columns by powers of two, and P sorts them by pivot. The normal equations are not used. One
/// correction step with the same factors improves the last digits of the estimates. If the
/// condition number (for columns scaled to equal length) is above refinement_above, the solution,
/// its residuals and the covariance are refined by Bjorck's augmented system, with residuals in
/// double-double. Nearly all digits that the data determine are then correct.
///
/// @par Source
/// Golub & Van Loan, Matrix Computations, 4th ed. (2013), secs. 5.3, 5.4; A. Bjorck, "Iterative
/// refinement of linear least squares solutions I", BIT 7 (1967) 257-278.
class AXISCAL_EXPORT FactoredDesign {
 public:
  /// Condition number above which solutions are refined.
  static constexpr double refinement_above = 100.0;

  /// @param design   X, n x p with n >= p; any units.
  /// @param weights  n weights, not negative; empty: all 1. A weight 0 leaves the row out.
  /// @param names    returns the parameters' names for errors; default: "parameter 1", ...
  /// @throws DomainError         if sizes disagree, if an entry is not finite, or if a weight is
  ///                             negative.
  /// @throws RankDeficientError  if the columns are dependent to working precision; the error names
  ///                             the parameters that the design does not determine.
  explicit FactoredDesign(const Eigen::Ref<const Eigen::MatrixXd>& design,
                          const Eigen::Ref<const Eigen::VectorXd>& weights = Eigen::VectorXd(),
                          const DesignNames& names = {});

  /// @param y  n observations [unit of y].
  /// @return b, p entries.
  [[nodiscard]] Eigen::VectorXd estimate(const Eigen::Ref<const Eigen::VectorXd>& y) const;

  /// @param Y  n x r, a column for each response.
  /// @return the estimates, p x r.
  [[nodiscard]] Eigen::MatrixXd estimates(const Eigen::Ref<const Eigen::MatrixXd>& Y) const;

  /// @return the ratio of the largest to the smallest singular value of W^1/2 X with columns of
  ///         length 1. Each call computes it again.
  [[nodiscard]] double condition_number() const;

  /// @return Q, n x p: orthonormal columns that span those of W^1/2 X.
  [[nodiscard]] const Eigen::MatrixXd& basis() const { return basis_; }

  /// @return T, p x p, with W^1/2 X T = Q. Therefore T T^T = (X^T W X)^-1. T is not refined.
  [[nodiscard]] Eigen::MatrixXd root_of_covariance() const { return scale_.asDiagonal() * root_; }

  /// @return the ratio of the smallest to the largest pivot, for columns of equal length.
  [[nodiscard]] double smallest_pivot() const;

  /// @return W^1/2, n entries.
  [[nodiscard]] const Eigen::VectorXd& root_weights() const { return root_weights_; }

  /// @return the number of rows of X with non-zero weight.
  [[nodiscard]] Eigen::Index observations() const { return observations_; }

 protected:
  struct Solution {
    Eigen::VectorXd x;          // coefficients of the scaled columns
    Eigen::VectorXd residuals;  // weighted residuals W^1/2 (y - X b)
  };
  [[nodiscard]] Solution solve(const Eigen::VectorXd& weighted_y) const;
  // Returns the coefficients of the scaled columns, without refinement.
  [[nodiscard]] Eigen::MatrixXd estimates_scaled(const Eigen::MatrixXd& weighted_Y) const;
  [[nodiscard]] Solution refined(const Eigen::VectorXd& b,
                                 const Eigen::VectorXd& c,
                                 Solution start) const;

  Eigen::VectorXd root_weights_;
  Eigen::MatrixXd scaled_;  // W^1/2 X with columns scaled by powers of two
  Eigen::VectorXd scale_;   // the powers of two
  struct Pivoted;
  std::shared_ptr<const Pivoted> qr_;  // QR of scaled_; kept only if solutions are refined
  Eigen::MatrixXd R_;      // p x p: factor R of scaled_ P, where P sorts columns by pivot
  Eigen::MatrixXd root_;   // p x p: P R^-1
  Eigen::MatrixXd basis_;  // n x p: factor Q of scaled_ P
  bool refines_ = false;   // true if the condition number is above refinement_above
  Eigen::Index observations_ = 0;

 private:
  // @return the columns whose coefficients are undetermined.
  [[nodiscard]] std::vector<Eigen::Index> factor(const Eigen::Ref<const Eigen::MatrixXd>& design,
                                                 const Eigen::Ref<const Eigen::VectorXd>& weights);
};

/// A factored design that also gives the statistics of each response's fit.
///
/// @code
/// const axiscal::LeastSquaresDesign design(X, weights, {"x.bias", "x.sensitivity.x"});
/// for (Eigen::Index k = 0; k < responses.cols(); ++k) {
///   const axiscal::LeastSquaresFit fit = design.fit(responses.col(k));
/// }
/// @endcode
///
/// @par Source
/// Belsley, Kuh & Welsch, Regression Diagnostics (1980) for leverage, studentised residuals and
/// Cook's distance.
class AXISCAL_EXPORT LeastSquaresDesign : public FactoredDesign {
 public:
  /// @param design, weights  as in FactoredDesign.
  /// @param names            names of the parameters, for error messages.
  explicit LeastSquaresDesign(const Eigen::Ref<const Eigen::MatrixXd>& design,
                              const Eigen::Ref<const Eigen::VectorXd>& weights = Eigen::VectorXd(),
                              const std::vector<std::string>& names = {});

  /// @param factored  the factored design.
  /// @param design    the matrix X from which `factored` was made.
  LeastSquaresDesign(FactoredDesign factored, const Eigen::Ref<const Eigen::MatrixXd>& design);

  /// Fits one response.
  ///
  /// @param observations  y: n observations, all in the same unit.
  /// @throws DomainError  if the number of observations is not n, or if one is not finite.
  [[nodiscard]] LeastSquaresFit fit(const Eigen::Ref<const Eigen::VectorXd>& observations) const;

  /// @return (X^T W X)^-1, p x p.
  [[nodiscard]] const Eigen::MatrixXd& unscaled_covariance() const { return unscaled_covariance_; }

  /// @return diagonal of the hat matrix, n entries.
  [[nodiscard]] const Eigen::VectorXd& leverage() const { return leverage_; }

 private:
  void find_unscaled_covariance();

  Eigen::MatrixXd design_;  // X; empty if all weights are above 0
  Eigen::MatrixXd unscaled_covariance_;
  Eigen::VectorXd leverage_;
  bool spans_constant_ = false;
};

/// Finds the parameters that a design leaves undetermined. These are the parameters with a nonzero
/// entry in a basis of the design's null space.
///
/// @param design  X, n x p; n may be less than p.
/// @return indices of the columns of these parameters, ascending; empty for full rank.
[[nodiscard]] AXISCAL_EXPORT std::vector<Eigen::Index> undetermined_columns(
    const Eigen::Ref<const Eigen::MatrixXd>& design);

/// Computes the variance inflation factors VIF_j = C_jj sum_i w_i (x_ij - mean_j)^2. mean_j is the
/// weighted mean of column j. VIF_j is the variance of coefficient j, divided by the variance of
/// this coefficient if column j were orthogonal to all other columns and to a constant.
///
/// @param design               X, n x p.
/// @param weights              n weights.
/// @param unscaled_covariance  C = (X^T W X)^-1, p x p. If the fit has columns besides X, C is the
///                             block that belongs to X in the unscaled covariance of all
///                             coefficients.
/// @return p factors, at least 1; NaN for a constant column.
/// @par Source
/// Belsley, Kuh & Welsch, Regression Diagnostics (1980), sec. 3.2.
[[nodiscard]] AXISCAL_EXPORT Eigen::VectorXd variance_inflation(
    const Eigen::Ref<const Eigen::MatrixXd>& design,
    const Eigen::Ref<const Eigen::VectorXd>& weights,
    const Eigen::Ref<const Eigen::MatrixXd>& unscaled_covariance);

/// Externally studentised residuals and Cook's distances from the results of a fit.
struct ResidualDiagnostics {
  Eigen::VectorXd studentized;
  Eigen::VectorXd cooks_distance;
};

/// Computes the externally studentised residuals t_i and Cook's distances D_i:
///
///     t_i = r_i / (s_(i) sqrt(1 - h_i)),   s_(i)^2 = (RSS - r_i^2 / (1 - h_i)) / (nu - 1)
///     D_i = r_i^2 h_i / (p s^2 (1 - h_i)^2),   RSS = sum r_i^2 = nu s^2
///
/// @param weighted_residuals  r_i = sqrt(w_i) (y_i - fit_i).
/// @param leverage            h_i, the diagonal of the hat matrix.
/// @param degrees_of_freedom  nu, not necessarily an integer.
/// @param parameters          p, the number of parameters.
/// @return t_i and D_i; NaN if h_i is 1, or if there are too few degrees of freedom.
[[nodiscard]] AXISCAL_EXPORT ResidualDiagnostics
diagnose_residuals(const Eigen::Ref<const Eigen::VectorXd>& weighted_residuals,
                   const Eigen::Ref<const Eigen::VectorXd>& leverage,
                   double degrees_of_freedom,
                   double parameters);

/// Like diagnose_residuals(), but for a known standard deviation s: t_i = r_i / (s sqrt(1 - h_i)).
///
/// @param scatter  s, the standard deviation of an observation of weight 1.
[[nodiscard]] AXISCAL_EXPORT ResidualDiagnostics
scale_residuals(const Eigen::Ref<const Eigen::VectorXd>& weighted_residuals,
                const Eigen::Ref<const Eigen::VectorXd>& leverage,
                double scatter,
                double parameters);

}  // namespace axiscal
