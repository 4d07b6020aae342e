// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "axiscal/core/version.hpp"

namespace axiscal {

/// One point of an Allan deviation curve.
struct AllanPoint {
  double tau_s = 0.0;
  std::size_t samples = 0;  ///< m, number of averaged samples; tau = m / rate
  std::size_t terms = 0;    ///< number of averaged second differences
  double deviation = 0.0;   ///< [unit of the samples]
  /// Equivalent degrees of freedom of the variance, for the kind of noise that the local slope of
  /// the curve shows.
  double degrees_of_freedom = 0.0;
  /// A cautious lower bound of the degrees of freedom; 0 if not known. At long tau it is at most
  /// the value for a random walk, because a random walk whose deviation is low by chance looks like
  /// white noise, which has more degrees of freedom.
  double fewest_degrees_of_freedom = 0.0;
  /// Bounds of the 68.3 % interval of the deviation, from the chi^2 distribution.
  double low = 0.0;
  double high = 0.0;
};

/// Computes the degrees of freedom and the intervals of the points of a curve from their
/// deviations.
/// @param points  must contain tau_s, samples and deviation.
/// @param phases  number of phases of the record: its number of samples + 1.
void add_intervals(std::vector<AllanPoint>& points, double phases);

/// @return the averaging lengths m = 1, 2, 4, ... up to a third of the number of samples.
[[nodiscard]] std::vector<std::size_t> octave_lengths(std::size_t samples);

/// @return averaging lengths m, about ten per decade, up to a third of the number of samples.
[[nodiscard]] std::vector<std::size_t> decade_lengths(std::size_t samples);

/// Overlapping Allan deviation.
///
///     sigma^2(m) = sum_i (x_(i+2m) - 2 x_(i+m) + x_i)^2 / (2 tau^2 (N - 2m + 1)),  tau = m tau_0
///
/// Here x is the phase, which is the running sum of y_i tau_0, and N is the number of samples. The
/// samples are processed block by block for all lengths, so a long record is read from memory once.
///
/// @param samples  y, evenly spaced; their mean is removed first.
/// @param rate_hz  1 / tau_0.
/// @param lengths  m, in ascending order; a length of more than half the samples gives no point.
/// @throws DomainError  if there are fewer than 2 samples, or a sample is not finite.
/// @par Source
/// W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065 (2008), eqs. 9-11; intervals
/// by its sec. 5.3 with the approximate degrees of freedom of its table 5.
[[nodiscard]] std::vector<AllanPoint> allan_deviation(std::span<const double> samples,
                                                      double rate_hz,
                                                      std::span<const std::size_t> lengths);

/// Computes the overlapping Allan deviation like allan_deviation(), but replaces the samples by
/// their phase. It allocates no copy of them, and is several times as fast for a long record.
/// @throws DomainError  for the same reasons as allan_deviation(); `samples` then stays unchanged.
[[nodiscard]] std::vector<AllanPoint> allan_deviation_in_place(
    std::span<double> samples, double rate_hz, std::span<const std::size_t> lengths);

/// Computes the overlapping Allan deviation of phase data, for example of a clock.
/// @param phase  the phases [unit of the samples times s], one more than there are samples.
[[nodiscard]] std::vector<AllanPoint> allan_deviation_of_phase(
    std::span<const double> phase, double rate_hz, std::span<const std::size_t> lengths);

}  // namespace axiscal
