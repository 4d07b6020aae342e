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
  std::size_t samples = 0;  ///< number m of samples in one average; tau = m / sampling rate
  std::size_t terms = 0;    ///< number of second differences whose squares are averaged
  double deviation = 0.0;   ///< Allan deviation, in the unit of the samples
  /// Equivalent degrees of freedom of the Allan variance. They depend on the kind of noise, which
  /// is inferred from the slope of the curve at this point.
  double degrees_of_freedom = 0.0;
  /// Lower bound of the degrees of freedom; 0 if not known. At long tau, the bound is at most the
  /// number of degrees of freedom for a random walk. The reason is that a random walk may by chance
  /// have the slope of white noise, which has more degrees of freedom.
  double fewest_degrees_of_freedom = 0.0;
  /// Ends of the 68.3 % confidence interval of the deviation, from the chi^2 distribution.
  double low = 0.0;
  double high = 0.0;
};

/// Computes the degrees of freedom and the confidence interval of each point of a curve.
/// @param points  points in which tau_s, samples and deviation are set; receives the degrees of
///                freedom and the intervals.
/// @param phases  number of phases of the record, which is the number of its samples + 1.
void add_intervals(std::vector<AllanPoint>& points, double phases);

/// @return the averaging lengths m = 1, 2, 4, ... up to a third of the number of samples.
[[nodiscard]] std::vector<std::size_t> octave_lengths(std::size_t samples);

/// @return averaging lengths m, about ten per decade, up to a third of the number of samples.
[[nodiscard]] std::vector<std::size_t> decade_lengths(std::size_t samples);

/// Computes the overlapping Allan deviation.
///
///     sigma^2(m) = sum_i (x_(i+2m) - 2 x_(i+m) + x_i)^2 / (2 tau^2 (N - 2m + 1)),  tau = m tau_0
///
/// Here x is the phase, which is the running sum of y_i tau_0, and N is the number of samples. The
/// samples are processed block by block for all lengths, so a long record is read from memory once.
///
/// @param samples  evenly spaced samples y; their mean is removed first.
/// @param rate_hz  sampling rate 1 / tau_0.
/// @param lengths  averaging lengths m [samples], ascending; lengths of more than half the record
///                 are ignored.
/// @throws DomainError  if there are fewer than 2 samples, or a sample is not finite.
/// @par Source
/// W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065 (2008), eqs. 9-11. The
/// intervals are those of its sec. 5.3 with the approximate degrees of freedom of its table 5.
[[nodiscard]] std::vector<AllanPoint> allan_deviation(std::span<const double> samples,
                                                      double rate_hz,
                                                      std::span<const std::size_t> lengths);

/// Computes the overlapping Allan deviation like allan_deviation(), but overwrites `samples` with
/// their phase instead of allocating a copy. For a long record this is several times as fast.
/// @throws DomainError  for the same reasons as allan_deviation(); `samples` then stays unchanged.
[[nodiscard]] std::vector<AllanPoint> allan_deviation_in_place(
    std::span<double> samples, double rate_hz, std::span<const std::size_t> lengths);

/// Computes the overlapping Allan deviation of phase data, for example of a clock.
/// @param phase  the phases [unit of the samples times s]; a record of n samples has n + 1 phases.
[[nodiscard]] std::vector<AllanPoint> allan_deviation_of_phase(
    std::span<const double> phase, double rate_hz, std::span<const std::size_t> lengths);

}  // namespace axiscal
