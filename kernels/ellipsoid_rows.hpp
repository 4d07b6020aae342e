// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace axiscal {

/// Readings v as three columns of n, and an ellipsoid |A (v - b)| = 1 among them.
struct EllipsoidReadings {
  std::array<const double*, 3> v{};
  std::size_t n = 0;
  std::array<std::array<double, 3>, 3> A{};
  std::array<double, 3> b{};
};

/// The weights of the readings' deviations.
struct EllipsoidWeights {
  const double* root_weights = nullptr;  ///< n
  /// C = A N A^T, N the covariance of a reading up to a factor.
  std::array<std::array<double, 3>, 3> C{};
  bool symmetric = false;  ///< true if an off-diagonal entry of A stands for two entries
};

/// Columns of n that are set.
struct EllipsoidRows {
  double* scale = nullptr;      ///< root weight over the standard deviation of |f|, (u^T C u)^1/2
  double* residuals = nullptr;  ///< scale times |f| - 1, f = A (v - b)
  /// How those change with b, and with A's entries on and above the diagonal, row by row.
  std::array<double*, 9> jacobian{};
};

/// With u = f / |f|: d|f| / db = -A^T u, d|f| / dA_jk = u_j (v - b)_k.
void ellipsoid_rows(const EllipsoidReadings& readings,
                    const EllipsoidWeights& weights,
                    const EllipsoidRows& rows);

/// @param scale  n.
/// @return the sum of squares of scale times |f| - 1, by as many accumulators as the machine likes.
[[nodiscard]] double ellipsoid_squares(const EllipsoidReadings& readings, const double* scale);

/// The same in plain code: the reference.
void ellipsoid_rows_plain(const EllipsoidReadings& readings,
                          const EllipsoidWeights& weights,
                          const EllipsoidRows& rows);
[[nodiscard]] double ellipsoid_squares_plain(const EllipsoidReadings& readings,
                                             const double* scale);

}  // namespace axiscal
