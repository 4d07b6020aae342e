// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace axiscal {

/// Variants of the Allan deviation. Each formula below gives the variance, which is the square of
/// the deviation. In the formulas, x is the phase at N points, and tau = m tau_0.
enum class OtherDeviation {
  /// sum_j (sum_(i=j..j+m-1) x_(i+2m) - 2 x_(i+m) + x_i)^2 / (2 m^2 tau^2 (N - 3m + 1)). Unlike the
  /// Allan deviation, it distinguishes white from flicker phase noise.
  modified,
  /// sum_i (x_(i+3m) - 3 x_(i+2m) + 3 x_(i+m) - x_i)^2 / (6 tau^2 (N - 3m)). It is insensitive to a
  /// ramp.
  hadamard,
  /// sum_i (x_(i-m) - 2 x_i + x_(i+m))^2 / (2 tau^2 (N - 2)). The phase is continued at both ends
  /// by point reflection, which reduces the uncertainty at the longest tau.
  total,
};

inline constexpr std::array all_other_deviations = {
    OtherDeviation::modified, OtherDeviation::hadamard, OtherDeviation::total};

/// @return "mdev", "hdev", "totdev".
[[nodiscard]] std::string name_of(OtherDeviation which);
[[nodiscard]] std::optional<OtherDeviation> other_deviation_of(std::string_view name);

/// Computes one variant of the Allan deviation for several averaging lengths [samples].
/// @param samples  evenly spaced samples; their mean is removed first.
/// @return one deviation for each length; NaN if the length is too long for the record.
/// @throws DomainError  for the same reasons as allan_deviation().
/// @par Source
/// W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065 (2008), secs. 5.2.5, 5.2.9,
/// 5.2.11.
[[nodiscard]] std::vector<double> other_deviations(OtherDeviation which,
                                                   std::span<const double> samples,
                                                   double rate_hz,
                                                   std::span<const std::size_t> lengths);

/// Computes one variant of the Allan deviation from phase data; see other_deviations().
[[nodiscard]] std::vector<double> other_deviations_of_phase(OtherDeviation which,
                                                            std::span<const double> phase,
                                                            double rate_hz,
                                                            std::span<const std::size_t> lengths);

}  // namespace axiscal
