// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace axiscal {

/// A linear regression whose design stays the same, factored once; n readings, p parameters.
/// Matrices row by row.
struct RepeatedDesign {
  std::size_t readings = 0;            ///< n
  std::size_t parameters = 0;          ///< p, less than n
  std::vector<double> design;          ///< X, n x p
  std::vector<double> pseudo_inverse;  ///< (X^T X)^-1 X^T, p x n, made by QR
};

/// Fits many responses at one design: b = P y, and the real residuals y - X b.
///
/// @param responses  n x m, row by row: entry i m + u is reading i of response u.
/// @param estimates  p x m, row by row.
/// @param rss        m residual sums of squares.
void fit_repeatedly(const RepeatedDesign& design,
                    std::span<const double> responses,
                    std::span<double> estimates,
                    std::span<double> rss);

/// The same in plain code: the reference.
void fit_repeatedly_plain(const RepeatedDesign& design,
                          std::span<const double> responses,
                          std::span<double> estimates,
                          std::span<double> rss);

}  // namespace axiscal
