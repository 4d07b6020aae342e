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
  std::size_t samples = 0;  ///< m, averaged samples: tau = m / rate
  std::size_t terms = 0;    ///< second differences in the mean
  double deviation = 0.0;   ///< [unit of the samples]
  /// Equivalent degrees of freedom of the variance, and the 68.3 % interval of the deviation by
  /// chi^2; for the noise that the slope there is of.
  double degrees_of_freedom = 0.0;
  /// The same if the noise may be a random walk there: a long average that is low by chance looks
  /// like white noise, which has more. 0: not known.
  double fewest_degrees_of_freedom = 0.0;
  double low = 0.0;
  double high = 0.0;
};

/// Fills degrees of freedom and intervals of the points of a curve by their deviations.
/// @param points  with tau_s, samples and deviation.
/// @param phases  of the record: one more than its samples.
void add_intervals(std::vector<AllanPoint>& points, double phases);

/// Averaging lengths m = 1, 2, 4, ... up to a third of the samples.
[[nodiscard]] std::vector<std::size_t> octave_lengths(std::size_t samples);

/// About ten lengths a decade, up to a third of the samples.
[[nodiscard]] std::vector<std::size_t> decade_lengths(std::size_t samples);

/// Overlapping Allan deviation.
///
///     sigma^2(m) = sum_i (x_(i+2m) - 2 x_(i+m) + x_i)^2 / (2 tau^2 (N - 2m + 1)),  tau = m tau_0
///
/// with x the phase, the running sum of y_i tau_0. All lengths are taken block by block, so that a
/// long record passes through the memory once.
///
/// @param samples  y, evenly spaced; their mean is removed first.
/// @param rate_hz  1 / tau_0.
/// @param lengths  m, ascending; those of more than half the samples give no point.
/// @throws DomainError  for fewer than 3 samples, or one that is not finite.
/// @par Source
/// W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065 (2008), eqs. 9-11; intervals
/// by its sec. 5.3 with the approximate degrees of freedom of its table 5.
[[nodiscard]] std::vector<AllanPoint> allan_deviation(std::span<const double> samples,
                                                      double rate_hz,
                                                      std::span<const std::size_t> lengths);

/// The same without memory of its own, several times as fast for a long record: the samples become
/// their phase.
/// @throws DomainError  as above; the samples then stay unchanged.
[[nodiscard]] std::vector<AllanPoint> allan_deviation_in_place(
    std::span<double> samples, double rate_hz, std::span<const std::size_t> lengths);

/// The same from phase data, as clocks give it: N + 1 phases of N samples [unit times s].
[[nodiscard]] std::vector<AllanPoint> allan_deviation_of_phase(
    std::span<const double> phase, double rate_hz, std::span<const std::size_t> lengths);

}  // namespace axiscal
