// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/reading_step.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

namespace axiscal {
namespace {

constexpr double by_chance = 0.001;  // largest probability that an accepted step is chance
constexpr double steps_tried = 20.0;

// Returns the nearest integer. This is faster than std::round, which is a function call unless the
// processor is known to have a rounding instruction.
double nearest(double value) {
  constexpr double all_are_whole = 4503599627370496.0;  // 2^52: every larger double is an integer
  if (!(std::abs(value) < all_are_whole)) {
    return value;
  }
  return static_cast<double>(static_cast<std::int64_t>(value < 0.0 ? value - 0.5 : value + 0.5));
}

// Returns true if the differences between the readings are multiples of the step.
bool are_multiples(const std::vector<double>& readings, double step) {
  return std::all_of(readings.begin(), readings.end(), [&](double reading) {
    const double steps = (reading - readings.front()) / step;
    constexpr double whole = 1e-3;
    return std::abs(steps - nearest(steps)) <= whole;
  });
}

// Returns the number of decimals that all values need; nullopt if they need the full precision of
// doubles.
std::optional<int> decimals_of(const std::vector<double>& values) {
  constexpr int most = 15;
  constexpr double largest_whole = 4503599627370496.0;  // 2^52: larger doubles have no fraction
  double power = 1.0;
  for (int d = 0; d <= most; ++d, power *= 10.0) {
    const bool all = std::all_of(values.begin(), values.end(), [&](double value) {
      const double scaled = value * power;
      constexpr double rounding = 4.0 * std::numeric_limits<double>::epsilon();
      return std::abs(scaled) < largest_whole &&
             std::abs(scaled - nearest(scaled)) <= rounding * std::abs(scaled);
    });
    if (all) {
      return d;
    }
  }
  return std::nullopt;
}

// Returns the step in units of the last digit: the greatest common divisor of the differences
// between the distinct values. Returns 1 if a larger divisor may be chance.
double digits_of_step(const std::vector<double>& distinct, double per_unit) {
  std::int64_t common = 0;
  const auto first = static_cast<std::int64_t>(std::llround(distinct.front() * per_unit));
  for (const double value : distinct) {
    common = std::gcd(common, static_cast<std::int64_t>(std::llround(value * per_unit)) - first);
    if (common == 1) {
      return 1.0;
    }
  }
  const auto g = static_cast<double>(common);
  const auto others = static_cast<double>(distinct.size()) - 2.0;
  return g > 1.0 && steps_tried * std::pow(g, -others) < by_chance ? g : 1.0;
}

// Finds a step that the digits do not show, for example the step of counts multiplied by a factor.
// It is the smallest gap between values, or an integer fraction of this gap.
// @param tolerance  half of the last digit.
std::optional<double> scaled_step(const std::vector<double>& distinct, double tolerance) {
  double gap = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < distinct.size(); ++i) {
    gap = std::min(gap, distinct[i] - distinct[i - 1]);
  }
  // The first difference that clearly exceeds the gap, in units of the gap. It excludes most
  // fractions quickly.
  double in_gaps = 1.0;
  for (std::size_t i = 1; i < distinct.size() && in_gaps < 1.5; ++i) {
    in_gaps = (distinct[i] - distinct.front()) / gap;
  }
  const double smallest_step = 10.0 * tolerance;
  for (int part = 1; static_cast<double>(part) <= steps_tried; ++part) {
    double step = gap / part;
    // Rounding changes a gap by at most 2 tolerances, so a fraction this small is not a step.
    if (step < 0.5 * smallest_step) {
      break;
    }
    const double count_of_first = in_gaps * part;
    const double off = std::abs(count_of_first - nearest(count_of_first)) * step;
    constexpr double safely = 8.0;  // margin; excludes no step that would pass the test below
    if (off > safely * (4.0 * tolerance + 8.0 * count_of_first * tolerance / part)) {
      continue;
    }
    double unsure = 4.0 * tolerance / part;  // uncertainty of the step
    double products = 0.0;
    double squares = 0.0;
    bool fits = true;
    // The loop goes from small to large differences. Each difference improves the estimate of the
    // step, which makes it possible to count the steps in the next difference. The loop ends if a
    // difference deviates from a multiple of the step by more than the tolerances allow.
    for (std::size_t i = 1; i < distinct.size() && fits; ++i) {
      const double difference = distinct[i] - distinct.front();
      const double count = nearest(difference / step);
      products += count * difference;
      squares += count * count;
      fits = count > 0.0 &&
             std::abs(difference - count * step) <= 2.0 * (2.0 * tolerance + count * unsure);
      step = fits ? products / squares : step;
      unsure = 2.0 * tolerance * std::sqrt(static_cast<double>(i) / squares);
    }
    fits = fits && step >= smallest_step &&
           std::all_of(distinct.begin(), distinct.end(), [&](double value) {
             const double difference = value - distinct.front();
             return std::abs(difference - step * nearest(difference / step)) <= 2.0 * tolerance;
           });
    const auto others = static_cast<double>(distinct.size()) - 2.0;
    if (fits && steps_tried * std::pow(4.0 * tolerance / step, others) < by_chance) {
      return step;
    }
  }
  return std::nullopt;
}

// A wider step that the first readings of a list have in common.
struct WideStep {
  std::ptrdiff_t readings = 0;  // number of readings with this step; 0: not found
  double steps = 1.0;           // size of the wider step, in units of the step of all readings
};

// Finds the widest step that the first readings have in common.
// @param readings  the readings in the order of the search.
// @param least     the rounding step that all readings have.
WideStep wide_step_of_first(const std::vector<double>& readings, double least) {
  WideStep widest;
  std::int64_t common = 0;
  std::set<std::int64_t> distinct;
  for (std::size_t i = 0; i < readings.size() && common != 1; ++i) {
    const auto count = static_cast<std::int64_t>(std::llround((readings[i] - readings[0]) / least));
    common = std::gcd(common, count);
    distinct.insert(count);
    const auto g = static_cast<double>(common);
    const auto differences = static_cast<double>(distinct.size()) - 1.0;
    // The probability that random integers have a common factor of g or more is the sum of
    // h^-differences over h >= g.
    constexpr double ends_tried = 10.0;
    const double share = std::pow(g, 1.0 - differences) / (differences - 1.0);
    if (g > 1.0 && differences >= 3.0 && g >= widest.steps && ends_tried * share < by_chance) {
      widest = {.readings = static_cast<std::ptrdiff_t>(i) + 1, .steps = g};
    }
  }
  return widest;
}

// Increases the steps that the readings of all axes show together. Few readings of an axis do not
// show a wide step by themselves. An instrument may have wider steps in higher measuring ranges, so
// the search goes through the ranges, starting with the largest readings.
void add_steps_by_range(const Eigen::MatrixXd& response,
                        const Eigen::MatrixXd& weights,
                        Eigen::MatrixXd& steps) {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> places;  // row and axis of used readings
  for (Eigen::Index k = 0; k < response.cols(); ++k) {
    for (Eigen::Index i = 0; i < response.rows(); ++i) {
      if (weights(i, k) > 0.0) {
        places.emplace_back(i, k);
      }
    }
  }
  const auto value = [&](const auto& place) { return response(place.first, place.second); };
  std::sort(places.begin(), places.end(),
            [&](const auto& a, const auto& b) { return std::abs(value(a)) > std::abs(value(b)); });
  std::vector<double> readings(places.size());
  std::transform(places.begin(), places.end(), readings.begin(), value);
  constexpr double by_digits = 0.0;  // noise of 0, so that only steps in the digits are found
  for (auto first = places.begin(); first != places.end();) {
    const std::optional<double> least = detect_rounding_step(readings, 0.0, by_digits);
    for (auto place = first; place != places.end() && least; ++place) {
      double& one = steps(place->first, place->second);
      one = std::max(one, *least);
    }
    const WideStep wide = least ? wide_step_of_first(readings, *least) : WideStep();
    if (wide.readings == 0) {
      return;
    }
    for (const auto end = first + wide.readings; first != end; ++first) {
      double& one = steps(first->first, first->second);
      one = std::max(one, wide.steps * *least);
    }
    readings.erase(readings.begin(), readings.begin() + wide.readings);
  }
}

}  // namespace

std::optional<double> detect_rounding_step(std::vector<double> readings,
                                           double stated_step,
                                           double noise_sd) {
  if (stated_step > 0.0 && are_multiples(readings, stated_step)) {
    return stated_step;
  }
  std::sort(readings.begin(), readings.end());
  readings.erase(std::unique(readings.begin(), readings.end()), readings.end());
  if (readings.size() < 3) {
    return std::nullopt;
  }
  const std::optional<int> decimals = decimals_of(readings);
  double step = 0.0;
  double tolerance = 4.0 * std::numeric_limits<double>::epsilon() *
                     std::max(std::abs(readings.front()), std::abs(readings.back()));
  if (decimals) {
    const double per_unit = std::pow(10.0, *decimals);
    step = digits_of_step(readings, per_unit) / per_unit;
    tolerance = std::max(tolerance, 0.5 / per_unit);
  }
  constexpr double averaged_away = 0.4;  // limit of step / noise; noise averages out smaller steps
  if (step < averaged_away * noise_sd) {
    if (const std::optional<double> scaled = scaled_step(readings, tolerance)) {
      return scaled;
    }
  }
  return step > 0.0 ? std::optional(step) : std::nullopt;
}

std::vector<double> readings_with_weight(const Eigen::Ref<const Eigen::VectorXd>& readings,
                                         const Eigen::Ref<const Eigen::VectorXd>& weights) {
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(readings.size()));
  for (Eigen::Index i = 0; i < readings.size(); ++i) {
    if (weights(i) > 0.0) {
      values.push_back(readings(i));
    }
  }
  return values;
}

Eigen::MatrixXd detect_rounding_steps(const Eigen::MatrixXd& response,
                                      const Eigen::MatrixXd& weights,
                                      double stated_step,
                                      const Eigen::VectorXd& noise_sd) {
  Eigen::MatrixXd steps(response.rows(), response.cols());
  for (Eigen::Index k = 0; k < response.cols(); ++k) {
    const double noise =
        noise_sd.size() > 0 ? noise_sd(k) : std::numeric_limits<double>::infinity();
    steps.col(k).setConstant(
        detect_rounding_step(readings_with_weight(response.col(k), weights.col(k)), stated_step,
                             noise)
            .value_or(0.0));
  }
  add_steps_by_range(response, weights, steps);
  return steps;
}

}  // namespace axiscal
