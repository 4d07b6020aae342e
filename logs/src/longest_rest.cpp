// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/longest_rest.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "axiscal/core/units.hpp"

namespace axiscal {
namespace {

// The mean and the variance of each window of a column.
struct Windows {
  std::vector<double> mean, variance;
};

// Computes the mean and the variance of each window of a column. The variance excludes the sample
// farthest from the mean, so that a single wrong sample is not taken for motion.
Windows windows_of(std::span<const double> samples, std::size_t length) {
  Windows windows;
  for (std::size_t first = 0; first + length <= samples.size(); first += length) {
    const std::span<const double> own = samples.subspan(first, length);
    double sum = 0.0;
    double count = 0.0;
    for (const double value : own) {
      sum += std::isfinite(value) ? value : 0.0;
      count += std::isfinite(value) ? 1.0 : 0.0;
    }
    const double mean = sum / std::max(count, 1.0);
    double squares = 0.0;
    double farthest = 0.0;
    for (const double value : own) {
      const double square = std::isfinite(value) ? (value - mean) * (value - mean) : 0.0;
      squares += square;
      farthest = std::max(farthest, square);
    }
    windows.mean.push_back(mean);
    windows.variance.push_back((squares - farthest) / std::max(count - 2.0, 1.0));
  }
  return windows;
}

double quantile_of(std::vector<double> values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// @return the resolution of the readings, which is the smallest change between successive samples.
double step_of(std::span<const double> samples) {
  double step = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double change = std::abs(samples[i] - samples[i - 1]);
    step = change > 0.0 ? std::min(step, change) : step;
  }
  return std::isfinite(step) ? step : 0.0;
}

// Finds the windows that are not at rest. These are windows whose variance is too large in at least
// one column, and windows whose variance is 0 in all columns, because the sensor is then in a sleep
// mode.
// @param quietest  a probability, 0 to 1. The quantile of a column's variances at this probability
//                  is taken as its variance at rest.
// @return 1 for each window that is not at rest, 0 for the others.
std::vector<char> loud_windows(const std::vector<RestColumn>& columns,
                               const std::vector<Windows>& windows,
                               double quietest) {
  const std::size_t n = windows.front().variance.size();
  std::vector<char> loud(n, 0);
  std::vector<char> frozen(n, 1);
  bool any = false;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const std::vector<double>& variance = windows[c].variance;
    const double step = step_of(columns[c].samples);
    // Windows with a variance of 0 are ignored here: the sensor was in a sleep mode, not at rest.
    std::vector<double> awake;
    std::copy_if(variance.begin(), variance.end(), std::back_inserter(awake),
                 [](double one) { return one > 0.0; });
    if (awake.empty()) {
      continue;  // the column does not vary
    }
    const double base = std::max(quantile_of(awake, quietest), 0.25 * step * step);
    any = true;
    // The factor is larger if the noise changes with time, because the variances of windows at rest
    // then differ more.
    constexpr double least = 8.0;
    constexpr double most = 40.0;
    const double factor = std::clamp(std::pow(quantile_of(awake, 0.5) / base, 4.0), least, most);
    for (std::size_t i = 0; i < n; ++i) {
      loud[i] = static_cast<char>(loud[i] != 0 || variance[i] > factor * base);
      frozen[i] = static_cast<char>(frozen[i] != 0 && variance[i] == 0.0);
    }
  }
  for (std::size_t i = 0; i < n && any; ++i) {
    loud[i] = static_cast<char>(loud[i] != 0 || frozen[i] != 0);  // frozen: in a sleep mode
  }
  return loud;
}

// @return the longest sequence of windows at rest (`loud` is 0), as the index of its first window
//         and one past the index of its last window.
std::pair<std::size_t, std::size_t> longest_quiet(const std::vector<char>& loud) {
  std::pair<std::size_t, std::size_t> longest = {0, 0};
  std::size_t first = 0;
  for (std::size_t i = 0; i <= loud.size(); ++i) {
    if (i == loud.size() || loud[i] != 0) {
      if (i - first > longest.second - longest.first) {
        longest = {first, i};
      }
      first = i + 1;
    }
  }
  return longest;
}

// True if the means of successive windows differ by more than is possible for a sensor at rest.
bool wanders(const std::vector<RestColumn>& columns,
             const std::vector<Windows>& windows,
             const std::pair<std::size_t, std::size_t>& run) {
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const double limit = columns[c].kind == SeriesKind::accelerometer ? 0.05
                         : columns[c].kind == SeriesKind::gyroscope   ? 0.3 * rad_per_deg
                                                                      : 0.0;
    double squares = 0.0;
    double count = 0.0;
    for (std::size_t i = run.first + 1; i < run.second; ++i) {
      const double change = windows[c].mean[i] - windows[c].mean[i - 1];
      squares += change * change;
      count += 1.0;
    }
    if (limit > 0.0 && columns[c].si > 0.0 && count > 0.0 &&
        columns[c].si * std::sqrt(0.5 * squares / count) > limit) {
      return true;
    }
  }
  return false;
}

}  // namespace

LongestRest longest_rest(const std::vector<RestColumn>& columns, double rate_hz) {
  const std::size_t n = columns.empty() ? 0 : columns.front().samples.size();
  constexpr double window_s = 0.5;
  constexpr std::size_t fewest_samples = 32;
  constexpr std::size_t fewest_windows = 8;
  std::size_t length = std::max<std::size_t>(
      static_cast<std::size_t>(std::lround(window_s * rate_hz)), fewest_samples);
  length = std::min(length, std::max<std::size_t>(n / fewest_windows, fewest_windows));
  if (n < fewest_windows * fewest_windows) {
    return {.first = 0, .end = n};  // too short to compare windows
  }
  std::vector<Windows> windows;
  for (const RestColumn& column : columns) {
    windows.push_back(windows_of(column.samples, length));
  }
  LongestRest rest;
  // The 2 % quantile is tried second: if less than a tenth of the log is at rest, the 10 % quantile
  // is not the variance at rest.
  for (const double quietest : {0.1, 0.02}) {
    const std::pair<std::size_t, std::size_t> run =
        longest_quiet(loud_windows(columns, windows, quietest));
    const std::size_t count = windows.front().mean.size();
    // A first or last window next to motion is left out, because a hand may already or still have
    // touched the instrument during that window.
    const std::size_t first = run.first > 0 ? run.first + 1 : 0;
    const std::size_t end =
        run.second < count ? run.second - std::min<std::size_t>(run.second, 1) : count;
    rest.first = first * length;
    rest.end = end == count ? n : end * length;
    if (rest.end <= rest.first) {
      rest = {.first = run.first * length, .end = run.second * length};
    }
    const double span_s = static_cast<double>(rest.end - rest.first) / rate_hz;
    constexpr double shortest_s = 10.0;
    const bool is_short = span_s < shortest_s && 2 * (rest.end - rest.first) < n;
    rest.moves = is_short || wanders(columns, windows, run);
    if (!rest.moves) {
      break;
    }
  }
  return rest;
}

}  // namespace axiscal
