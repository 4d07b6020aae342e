// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

namespace axiscal {

/// f_upper_p() within 0.015, for degrees of freedom of 2 and more: for questions whose answer is
/// far from it, in a fraction of the time.
/// @par Source
/// Paulson, Annals of Mathematical Statistics 13 (1942) 233-235: F's cube root is nearly a ratio of
/// normal variables.
[[nodiscard]] inline double f_upper_p_roughly(double f, double numerator, double denominator) {
  const double root = std::cbrt(f);
  const double of_numerator = 2.0 / (9.0 * numerator);
  const double of_denominator = 2.0 / (9.0 * denominator);
  const double z = ((1.0 - of_denominator) * root - (1.0 - of_numerator)) /
                   std::sqrt(of_denominator * root * root + of_numerator);
  return 0.5 * std::erfc(z / std::numbers::sqrt2);
}

/// The two-sided tail of Student's t by its square, f_upper_p(square, 1, nu), within 0.01 for
/// degrees of freedom of 2 and more, and 0.016 from 1 on.
/// @par Source
/// Wallace, Annals of Mathematical Statistics 30 (1959) 1124-1130, eq. 4.1.
[[nodiscard]] inline double t_two_sided_p_roughly(double square, double degrees_of_freedom) {
  const double nu = degrees_of_freedom;
  const double z = (8.0 * nu + 1.0) / (8.0 * nu + 3.0) * std::sqrt(nu * std::log1p(square / nu));
  return std::erfc(z / std::numbers::sqrt2);
}

}  // namespace axiscal
