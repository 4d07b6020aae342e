// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/temperature.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The line that is fitted to the readings of a window.
struct Line {
  double rate = 0.0;
  double rate_se = 0.0;  // standard error of `rate`; NaN for two readings
  double degrees_of_freedom = 0.0;
};

Line line_of(std::span<const double> time_s, std::span<const double> temperature) {
  const auto n = static_cast<Eigen::Index>(time_s.size());
  Eigen::MatrixXd X(n, 2);
  X.col(0).setOnes();
  for (Eigen::Index i = 0; i < n; ++i) {
    X(i, 1) = time_s[static_cast<std::size_t>(i)] - time_s.back();
  }
  const LeastSquaresFit fit =
      fit_least_squares(X, Eigen::Map<const Eigen::VectorXd>(temperature.data(), n));
  return {.rate = fit.estimate(1),
          .rate_se = std::sqrt(fit.covariance(1, 1)),
          .degrees_of_freedom = fit.degrees_of_freedom};
}

}  // namespace

SensorTemperature TemperatureResponse::reference() const {
  if (!has_own_sensors()) {
    return spans.front().reference;
  }
  std::vector<double> references;
  for (const TemperatureSpan& span : spans) {
    references.push_back(span.reference);
  }
  return SensorTemperature(std::move(references));
}

bool TemperatureResponse::is_extrapolated(const SensorTemperature& t) const {
  for (std::size_t k = 0; k < spans.size(); ++k) {
    const double own = has_own_sensors() ? t.of(static_cast<Eigen::Index>(k)) : t.mean();
    if (own < spans[k].low || own > spans[k].high) {
      return true;
    }
  }
  return false;
}

double TemperatureResponse::bias_shift(Eigen::Index axis, double t) const {
  double value = 0.0;
  for (Eigen::Index j = bias.cols(); j > 0; --j) {
    value = (value + bias(axis, j - 1)) * (t - span_of(axis).reference);
  }
  return value;
}

double TemperatureResponse::scale_at(Eigen::Index axis, double t) const {
  double value = 0.0;
  for (Eigen::Index j = scale.cols(); j > 0; --j) {
    value = (value + scale(axis, j - 1)) * (t - span_of(axis).reference);
  }
  return 1.0 + value;
}

std::string span_text(const TemperatureResponse& temperature,
                      const std::vector<std::string>& axes,
                      const std::function<std::string(const TemperatureSpan&)>& text) {
  if (!temperature.has_own_sensors()) {
    return text(temperature.spans.front());
  }
  std::vector<std::string> all;
  for (std::size_t k = 0; k < temperature.spans.size(); ++k) {
    all.push_back(formatted("{} {}", axes[k], text(temperature.spans[k])));
  }
  return joined(all);
}

std::vector<int> soak_levels(const std::vector<double>& temperatures) {
  const std::size_t n = temperatures.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return temperatures[a] < temperatures[b]; });
  if (n == 0 || temperatures[order.front()] == temperatures[order.back()]) {
    return std::vector<int>(n, 0);
  }
  // Divides the sorted list of gaps into gaps within levels and gaps between levels. The division
  // is at the largest ratio of successive gaps. This ratio must be above clear_ratio.
  std::vector<double> gaps;
  for (std::size_t i = 1; i < n; ++i) {
    gaps.push_back(temperatures[order[i]] - temperatures[order[i - 1]]);
  }
  std::sort(gaps.begin(), gaps.end());
  const double range = temperatures[order.back()] - temperatures[order.front()];
  constexpr double clear_ratio = 3.0;
  double split = 0.0;
  double best = clear_ratio;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const double below = i == 0 ? 0.0 : gaps[i - 1];
    const double ratio = gaps[i] / std::max(below, 1e-9 * range);
    if (gaps[i] > 0.02 * range && ratio > best) {
      best = ratio;
      split = gaps[i];
    }
  }
  if (split == 0.0) {
    return {};
  }
  std::vector<int> level(n, 0);
  int current = 0;
  double lowest = temperatures[order.front()];
  double widest = 0.0;
  for (std::size_t i = 1; i < n; ++i) {
    const double t = temperatures[order[i]];
    if (t - temperatures[order[i - 1]] >= split) {
      ++current;
      lowest = t;
    }
    widest = std::max(widest, t - lowest);
    level[order[i]] = current;
  }
  // The temperatures form levels only if each level is at most half as wide as the narrowest gap
  // between levels.
  const bool held = widest <= 0.5 * split && static_cast<std::size_t>(current) + 1 < n;
  return held ? level : std::vector<int>{};
}

SoakState soak_state(std::span<const double> time_s,
                     std::span<const double> temperature,
                     double window_s,
                     double tolerance) {
  if (time_s.size() != temperature.size() || !(window_s > 0.0) || !(tolerance > 0.0) ||
      !std::is_sorted(time_s.begin(), time_s.end())) {
    throw DomainError(
        "soak_state: needs one temperature for each time, ascending times, and a positive "
        "window and tolerance");
  }
  SoakState state{.rate = not_a_number, .rate_u = not_a_number, .remaining_s = not_a_number};
  if (time_s.empty()) {
    return state;
  }
  const auto start_of = [&](double end_s) {
    return static_cast<std::size_t>(
        std::lower_bound(time_s.begin(), time_s.end(), end_s - window_s) - time_s.begin());
  };
  const std::size_t from = start_of(time_s.back());
  const std::span<const double> t = time_s.subspan(from);
  // If the readings cover half a window or less, they are too few for a decision.
  if (t.size() < 3 || !(t.back() - t.front() > 0.5 * window_s)) {
    return state;
  }
  const Line line = line_of(t, temperature.subspan(from));
  state.rate = line.rate;
  state.rate_u = line.rate_se;
  const double largest =
      std::abs(line.rate) + student_t_factor(0.95, line.degrees_of_freedom) * line.rate_se;
  state.steady = largest * window_s <= tolerance;
  if (state.steady) {
    state.remaining_s = 0.0;
    return state;
  }
  // If the output approaches its limit like exp(-t / tau), tau follows from the present rate and
  // the rate one window earlier.
  const double earlier_end = t.front();
  const std::size_t earlier = start_of(earlier_end);
  if (from >= earlier + 3 && time_s[from - 1] - time_s[earlier] > 0.5 * window_s) {
    const Line before = line_of(time_s.subspan(earlier, from - earlier),
                                temperature.subspan(earlier, from - earlier));
    const double ratio = line.rate / before.rate;
    const double goal = tolerance / window_s;
    if (ratio > 0.0 && ratio < 1.0 && std::abs(line.rate) > goal) {
      state.remaining_s = window_s * std::log(std::abs(line.rate) / goal) / -std::log(ratio);
    }
  }
  return state;
}

}  // namespace axiscal
