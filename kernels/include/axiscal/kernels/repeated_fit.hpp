// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace axiscal {

/// A linear regression with a fixed design of n readings and p parameters. Matrices are stored row
/// by row.
struct RepeatedDesign {
  std::size_t readings = 0;            ///< n
  std::size_t parameters = 0;          ///< p, less than n
  std::vector<double> design;          ///< X, n x p
  std::vector<double> pseudo_inverse;  ///< (X^T X)^-1 X^T, p x n, computed by QR
};

/// Fits m responses with the same design: b = P y, with the residuals y - X b. P is the
/// pseudo-inverse.
///
/// @param responses  n x m, row by row: entry i m + u is reading i of response u.
/// @param estimates  p x m, row by row.
/// @param rss        m residual sums of squares.
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
