// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace axiscal {

/// A linear regression with a fixed design of n readings and p parameters. Matrices are stored row
/// by row.
struct RepeatedDesign {
  std::size_t readings = 0;            ///< number n of readings
  std::size_t parameters = 0;          ///< number p of parameters, less than n
  std::vector<double> design;          ///< X, n x p
  std::vector<double> pseudo_inverse;  ///< (X^T X)^-1 X^T, p x n, computed by QR
};

/// Fits m responses y with the same design. The estimates are b = P y, where P is the
/// pseudo-inverse, and the residuals are y - X b.
///
/// @param responses  n x m, row by row: entry i m + u is reading i of response u.
/// @param estimates  receives the estimates, p x m, row by row.
/// @param rss        receives the residual sums of squares, one for each response.
void fit_repeatedly(const RepeatedDesign& design,
                    std::span<const double> responses,
                    std::span<double> estimates,
                    std::span<double> rss);

/// Plain version of fit_repeatedly(), as a reference for tests.
void fit_repeatedly_plain(const RepeatedDesign& design,
                          std::span<const double> responses,
                          std::span<double> estimates,
                          std::span<double> rss);

}  // namespace axiscal
