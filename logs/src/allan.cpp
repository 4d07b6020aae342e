// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/allan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "kernels/second_differences.hpp"
#include "logs/src/phase.hpp"

namespace axiscal {
namespace {

// @return the equivalent degrees of freedom of an overlapping Allan variance (NIST SP 1065, table
//         5) for the kind of noise whose slope (-1, -1/2, 0 or +1/2) is closest to `slope`.
// @param slope   slope of the deviation over tau in a log-log plot.
// @param phases  number of phases (values of the samples' running integral).
// @param m       averaging length in samples.
double degrees_of_freedom(double slope, double phases, double m) {
  const double N = phases;
  double edf = 0.0;
  if (slope < -0.75) {  // white phase noise, such as quantisation
    edf = (N + 1.0) * (N - 2.0 * m) / (2.0 * (N - m));
  } else if (slope < -0.25) {  // white noise
    edf = (3.0 * (N - 1.0) / (2.0 * m) - 2.0 * (N - 2.0) / N) * 4.0 * m * m / (4.0 * m * m + 5.0);
  } else if (slope < 0.25) {  // flicker: bias instability
    edf = m < 1.5 ? 2.0 * (N - 2.0) / (2.3 * N - 4.9) * (N - 2.0)
                  : 5.0 * N * N / (4.0 * m * (N + 3.0 * m));
  } else {  // random walk
    edf = (N - 2.0) / m * ((N - 1.0) * (N - 1.0) - 3.0 * m * (N - 1.0) + 4.0 * m * m) /
          ((N - 3.0) * (N - 3.0));
  }
  return std::max(edf, 1.0);
}

}  // namespace

void add_intervals(std::vector<AllanPoint>& points, double phases) {
  constexpr double tail = 0.5 * (1.0 - 0.683);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const AllanPoint& before = points[i > 0 ? i - 1 : i];
    const AllanPoint& after = points[std::min(i + 1, points.size() - 1)];
    const double slope =
        after.tau_s > before.tau_s && before.deviation > 0.0 && after.deviation > 0.0
            ? std::log(after.deviation / before.deviation) / std::log(after.tau_s / before.tau_s)
            : -0.5;
    AllanPoint& point = points[i];
    // At long tau the deviations scatter, so a steep negative slope is attributed to chance, not to
    // phase noise.
    const bool is_long = static_cast<double>(point.samples) * 100.0 > phases;
    point.degrees_of_freedom = degrees_of_freedom(is_long ? std::max(slope, -0.5) : slope, phases,
                                                  static_cast<double>(point.samples));
    point.fewest_degrees_of_freedom = point.degrees_of_freedom;
    if (is_long) {
      constexpr double walk = 0.5;
      point.fewest_degrees_of_freedom =
          std::min(point.degrees_of_freedom,
                   degrees_of_freedom(walk, phases, static_cast<double>(point.samples)));
    }
    const double nu = point.degrees_of_freedom;
    point.low = point.deviation * std::sqrt(nu / chi_squared_quantile(1.0 - tail, nu));
    point.high = point.deviation * std::sqrt(nu / chi_squared_quantile(tail, nu));
  }
}

std::vector<std::size_t> octave_lengths(std::size_t samples) {
  std::vector<std::size_t> lengths;
  for (std::size_t m = 1; 3 * m <= samples; m *= 2) {
    lengths.push_back(m);
  }
  return lengths;
}

std::vector<std::size_t> decade_lengths(std::size_t samples) {
  std::vector<std::size_t> lengths;
  for (double at = 1.0; 3.0 * at <= static_cast<double>(samples); at *= std::pow(10.0, 0.1)) {
    const auto m = static_cast<std::size_t>(std::lround(at));
    if (lengths.empty() || m > lengths.back()) {
      lengths.push_back(m);
    }
  }
  return lengths;
}

namespace {

void require_enough(std::size_t phases) {
  if (phases < 3) {
    throw DomainError("allan_deviation: at least two samples (three phases) are needed");
  }
}

// Computes the Allan deviation curve of a record.
// @param phase        the phases of the record, which are the running integral of its samples.
// @param zero_before  true if `phase` lacks the first phase, which is 0.
std::vector<AllanPoint> curve_of(std::span<const double> phase,
                                 bool zero_before,
                                 double rate_hz,
                                 std::span<const std::size_t> lengths) {
  const std::size_t n = phase.size() + (zero_before ? 1 : 0);
  require_enough(n);
  std::vector<std::size_t> used;
  std::copy_if(lengths.begin(), lengths.end(), std::back_inserter(used),
               [&](std::size_t m) { return m >= 1 && 2 * m < n; });
  std::vector<double> sums;
  for (const std::size_t m : used) {
    sums.push_back(zero_before ? std::pow(phase[2 * m - 1] - 2.0 * phase[m - 1], 2) : 0.0);
  }
  // Each block is processed for all lengths before the next block, so that its data are in the
  // cache for several lengths. For one length, a block needs the phases x_i, x_(i+m) and x_(i+2m).
  // These are three sequences of at most 2048 numbers, which together are at most 48 KiB.
  constexpr std::size_t block = 2048;
  for (std::size_t first = 0; first < phase.size(); first += block) {
    for (std::size_t k = 0; k < used.size(); ++k) {
      if (first + 2 * used[k] < phase.size()) {
        sums[k] += sum_of_squared_second_differences(
            phase, used[k], first, std::min(block, phase.size() - 2 * used[k] - first));
      }
    }
  }
  std::vector<AllanPoint> points;
  for (std::size_t k = 0; k < used.size(); ++k) {
    const double tau = static_cast<double>(used[k]) / rate_hz;
    const std::size_t terms = n - 2 * used[k];
    points.push_back({.tau_s = tau,
                      .samples = used[k],
                      .terms = terms,
                      .deviation = std::sqrt(sums[k] / (2.0 * static_cast<double>(terms))) / tau});
  }
  add_intervals(points, static_cast<double>(n));
  return points;
}

}  // namespace

std::vector<AllanPoint> allan_deviation_of_phase(std::span<const double> phase,
                                                 double rate_hz,
                                                 std::span<const std::size_t> lengths) {
  return curve_of(phase, false, rate_hz, lengths);
}

void put_phase(std::span<const double> samples, double rate_hz, std::span<double> phase) {
  // The four sums do not depend on each other, so the processor can add to them in parallel.
  std::array<double, 4> sums{};
  std::size_t i = 0;
  for (; i + 4 <= samples.size(); i += 4) {
    for (std::size_t k = 0; k < 4; ++k) {
      sums[k] += samples[i + k];
    }
  }
  for (; i < samples.size(); ++i) {
    sums[0] += samples[i];
  }
  const double mean = (sums[0] + sums[1] + sums[2] + sums[3]) / static_cast<double>(samples.size());
  if (!std::isfinite(mean)) {
    throw DomainError("allan_deviation: a sample is not finite");
  }
  const double step = 1.0 / rate_hz;
  double sum = 0.0;
  const auto put = [&](std::size_t at, double more) { phase[at] = sum + more; };
  // Four samples are added to each other before they are added to `sum`. Then only one addition for
  // each group of four must wait for the result of the previous group.
  for (i = 0; i + 4 <= samples.size(); i += 4) {
    const double a = (samples[i] - mean) * step;
    const double ab = a + (samples[i + 1] - mean) * step;
    const double c = (samples[i + 2] - mean) * step;
    const double abcd = ab + (c + (samples[i + 3] - mean) * step);
    put(i, a);
    put(i + 1, ab);
    put(i + 2, ab + c);
    put(i + 3, abcd);
    sum += abcd;
  }
  for (; i < samples.size(); ++i) {
    sum += (samples[i] - mean) * step;
    phase[i] = sum;
  }
}

std::vector<AllanPoint> allan_deviation(std::span<const double> samples,
                                        double rate_hz,
                                        std::span<const std::size_t> lengths) {
  // The phases are aligned to cache lines, so that no vector instruction accesses two lines.
  constexpr std::size_t line = 64;
  std::size_t room = samples.size_bytes() + line;
  const auto memory = std::make_unique_for_overwrite<std::byte[]>(room);
  void* start = memory.get();
  const std::span phase(static_cast<double*>(std::align(line, samples.size_bytes(), start, room)),
                        samples.size());
  put_phase(samples, rate_hz, phase);
  return curve_of(phase, true, rate_hz, lengths);
}

std::vector<AllanPoint> allan_deviation_in_place(std::span<double> samples,
                                                 double rate_hz,
                                                 std::span<const std::size_t> lengths) {
  require_enough(samples.size() + 1);  // checked before put_phase() changes the samples
  put_phase(samples, rate_hz, samples);
  return curve_of(samples, true, rate_hz, lengths);
}

}  // namespace axiscal
