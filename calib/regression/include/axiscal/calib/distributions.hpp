// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/export.hpp"

namespace axiscal {

/// Coverage factor of a two-sided interval from Student's t distribution.
///
/// @param coverage            probability between 0 and 1, e.g. 0.95.
/// @param degrees_of_freedom  positive, not necessarily whole.
/// @return t such that P(|T| <= t) = coverage; NaN if an argument is out of range.
/// @par Source
/// Boost.Math.
[[nodiscard]] AXISCAL_EXPORT double student_t_factor(double coverage, double degrees_of_freedom);

/// The degrees of freedom for which student_t_factor() returns a given coverage factor.
///
/// @param factor    k, the coverage factor of an expanded uncertainty.
/// @param coverage  coverage probability between 0 and 1.
/// @return the degrees of freedom, at least 0.05; infinity if they are 1e6 or more, or if k is not
///         above the factor of the normal distribution; NaN if k is NaN.
[[nodiscard]] AXISCAL_EXPORT double freedom_of_factor(double factor, double coverage);

/// @return P(|T| > |t|) for Student's t; NaN if an argument is NaN or if the degrees of freedom are
///         not positive.
[[nodiscard]] AXISCAL_EXPORT double student_t_two_sided_p(double t, double degrees_of_freedom);

/// @return P(F > f) for Fisher's F with (numerator, denominator) degrees of freedom; NaN if an
///         argument is NaN or out of range.
[[nodiscard]] AXISCAL_EXPORT double f_upper_p(double f, double numerator, double denominator);

/// @return f with P(F <= f) = probability for Fisher's F; NaN outside 0 < probability < 1.
[[nodiscard]] AXISCAL_EXPORT double f_quantile(double probability,
                                               double numerator,
                                               double denominator);

/// @return P(X > x) for chi-squared; NaN if an argument is NaN or out of range.
[[nodiscard]] AXISCAL_EXPORT double chi_squared_upper_p(double x, double degrees_of_freedom);

/// Combines independent probabilities by Fisher's method: -2 sum ln p is chi-squared with two
/// degrees of freedom for each probability.
///
/// @par Source
/// Fisher, Statistical Methods for Research Workers, 4th ed. (1932), sec. 21.1.
class AXISCAL_EXPORT FisherSum {
 public:
  /// @return -2 ln p, the summand of Fisher's statistic; a p below 1e-300 is replaced by 1e-300.
  [[nodiscard]] static double term(double p);

  void add(double p);

  /// @return the number of probabilities.
  [[nodiscard]] double count() const { return count_; }

  /// @param loss  divisor of the degrees of freedom, above 1 if the tests are not independent
  ///              (Brown, Biometrics 31 (1975) 987-992).
  /// @return the combined probability; NaN if no probability was added, or if one was NaN.
  [[nodiscard]] double p_value(double loss = 1.0) const;

 private:
  double sum_ = 0.0;
  double count_ = 0.0;
};

/// @return x with P(X <= x) = probability for chi-squared; NaN if an argument is out of range.
[[nodiscard]] AXISCAL_EXPORT double chi_squared_quantile(double probability,
                                                         double degrees_of_freedom);

/// @return x with P(X <= x) = probability for the standard normal; NaN outside (0, 1).
[[nodiscard]] AXISCAL_EXPORT double normal_quantile(double probability);

}  // namespace axiscal
