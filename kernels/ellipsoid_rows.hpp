// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace axiscal {

/// Readings v in three columns of n entries, and the parameters A and b of an ellipsoid |A (v - b)|
/// = 1.
struct EllipsoidReadings {
  std::array<const double*, 3> v{};
  std::size_t n = 0;
  std::array<std::array<double, 3>, 3> A{};
  std::array<double, 3> b{};
};

/// The weights of the readings' deviations from the ellipsoid.
struct EllipsoidWeights {
  const double* root_weights = nullptr;  ///< square roots of the weights, n entries
  /// The matrix C = A N A^T; N is the covariance of a reading, up to a factor.
  std::array<std::array<double, 3>, 3> C{};
  bool symmetric = false;  ///< true if A is symmetric, so that A_jk and A_kj are one parameter
};

/// The output columns, n entries each. For a reading v, f = A (v - b) and u = f / |f|.
struct EllipsoidRows {
  /// Square root of the weight, divided by the standard deviation (u^T C u)^1/2 of |f|.
  double* scale = nullptr;
  double* residuals = nullptr;  ///< scale times (|f| - 1)
  /// Derivatives of the residuals with respect to b, then to A's entries on and above the diagonal,
  /// row by row.
  std::array<double*, 9> jacobian{};
};

/// Computes the residuals and derivatives for a linearised fit of the ellipsoid. With f = A (v - b)
/// and u = f / |f|, the derivatives are d|f| / db = -A^T u and d|f| / dA_jk = u_j (v - b)_k.
void ellipsoid_rows(const EllipsoidReadings& readings,
                    const EllipsoidWeights& weights,
                    const EllipsoidRows& rows);

/// @param scale  EllipsoidRows::scale, n entries.
/// @return the sum of (scale (|f| - 1))^2 over the readings. Its last digits depend on the
///         instruction set.
[[nodiscard]] double ellipsoid_squares(const EllipsoidReadings& readings, const double* scale);

/// Plain versions of the functions above, as references for tests.
void ellipsoid_rows_plain(const EllipsoidReadings& readings,
                          const EllipsoidWeights& weights,
                          const EllipsoidRows& rows);
[[nodiscard]] double ellipsoid_squares_plain(const EllipsoidReadings& readings,
                                             const double* scale);

}  // namespace axiscal
