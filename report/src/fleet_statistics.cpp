// SPDX-License-Identifier: Apache-2.0
#include "report/src/fleet_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

constexpr double normal_95 = 1.959964;

bool has_value(const FleetTest& test, std::size_t parameter) {
  return parameter < test.values.size() && std::isfinite(test.values[parameter]);
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) {
    sum += value;
  }
  return sum / static_cast<double>(values.size());
}

double sum_of_squares(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0.0;
  for (const double value : values) {
    sum += (value - mean) * (value - mean);
  }
  return sum;
}

// Returns for each batch the last test of each unit, if that test has a value of the parameter.
std::map<std::string, std::vector<const FleetTest*>> batches_of(const FleetUnits& units,
                                                                std::size_t parameter) {
  std::map<std::string, std::vector<const FleetTest*>> batches;
  for (std::size_t unit = 0; unit < units.tests.size(); ++unit) {
    const FleetTest& test = units.last(unit);
    if (has_value(test, parameter)) {
      batches[test.batch].push_back(&test);
    }
  }
  return batches;
}

std::vector<double> values_of(const std::vector<const FleetTest*>& tests, std::size_t parameter) {
  std::vector<double> values;
  values.reserve(tests.size());
  for (const FleetTest* const test : tests) {
    values.push_back(test->values[parameter]);
  }
  return values;
}

// Returns the standard deviation of values, estimated from the mean absolute difference of
// neighbouring values. A slow drift therefore hardly changes it.
double sd_of_moving_ranges(const std::vector<double>& values) {
  // Mean |difference| of two values of a normal distribution, divided by the standard deviation of
  // that distribution.
  constexpr double range_per_sd = 1.128379;
  double sum = 0.0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    sum += std::abs(values[i] - values[i - 1]);
  }
  return sum / static_cast<double>(values.size() - 1) / range_per_sd;
}

double sd_within(const std::map<std::string, std::vector<const FleetTest*>>& batches,
                 const std::vector<double>& by_date,
                 std::size_t parameter) {
  if (batches.size() < 2) {
    return sd_of_moving_ranges(by_date);
  }
  double squares = 0.0;
  double freedom = 0.0;
  for (const auto& [name, tests] : batches) {
    squares += sum_of_squares(values_of(tests, parameter));
    freedom += static_cast<double>(tests.size()) - 1.0;
  }
  return freedom > 0.0 ? std::sqrt(squares / freedom) : not_a_number;
}

double capability_index(const FleetParameter& limits, double mean, double sd) {
  double index = std::numeric_limits<double>::infinity();
  if (limits.low) {
    index = std::min(index, (mean - *limits.low) / (3.0 * sd));
  }
  if (limits.high) {
    index = std::min(index, (*limits.high - mean) / (3.0 * sd));
  }
  return std::isfinite(index) ? index : not_a_number;
}

// Median and robust standard deviation of a batch.
struct Spread {
  double median = 0.0;
  double sd = 0.0;
};

Spread spread_of(const std::vector<double>& values) {
  // Ratio of the standard deviation to the median absolute deviation, for a normal distribution.
  constexpr double sd_per_deviation = 1.482602;
  Spread spread{.median = upper_median(values)};
  std::vector<double> deviations;
  deviations.reserve(values.size());
  for (const double value : values) {
    deviations.push_back(std::abs(value - spread.median));
  }
  spread.sd = sd_per_deviation * upper_median(deviations);
  return spread;
}

}  // namespace

Share share_of(std::size_t count, std::size_t of) {
  Share share{.count = count, .of = of};
  if (of == 0) {
    return share;
  }
  const auto n = static_cast<double>(of);
  const double p = share.value();
  const double z2 = normal_95 * normal_95;
  const double middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
  const double half =
      normal_95 / (1.0 + z2 / n) * std::sqrt(p * (1.0 - p) / n + z2 / (4.0 * n * n));
  share.low = std::max(0.0, middle - half);
  share.high = std::min(1.0, middle + half);
  return share;
}

FleetUnits units_of(const Fleet& fleet) {
  std::map<std::string, std::vector<const FleetTest*>> by_serial;
  for (const FleetTest& test : fleet.tests) {
    by_serial[test.serial].push_back(&test);
  }
  const auto earlier = [](const FleetTest* a, const FleetTest* b) { return a->date < b->date; };
  FleetUnits units;
  for (auto& [serial, tests] : by_serial) {
    std::stable_sort(tests.begin(), tests.end(), earlier);
    units.tests.push_back(std::move(tests));
  }
  std::stable_sort(units.tests.begin(), units.tests.end(),
                   [&](const auto& a, const auto& b) { return earlier(a.back(), b.back()); });
  return units;
}

Capability capability_of(const Fleet& fleet, const FleetUnits& units, std::size_t parameter) {
  std::vector<const FleetTest*> tests;
  for (std::size_t unit = 0; unit < units.tests.size(); ++unit) {
    if (has_value(units.last(unit), parameter)) {
      tests.push_back(&units.last(unit));
    }
  }
  Capability result{.units = tests.size(),
                    .mean = not_a_number,
                    .sd = not_a_number,
                    .sd_within = not_a_number,
                    .ppk = not_a_number,
                    .ppk_low = not_a_number,
                    .cpk = not_a_number,
                    .median_u = not_a_number,
                    .median_u_with_prior = not_a_number};
  if (tests.size() < 2) {
    return result;
  }
  const std::vector<double> values = values_of(tests, parameter);
  const auto n = static_cast<double>(values.size());
  const auto batches = batches_of(units, parameter);
  result.mean = mean_of(values);
  result.sd = std::sqrt(sum_of_squares(values) / (n - 1.0));
  result.sd_within = sd_within(batches, values, parameter);
  result.ppk = capability_index(fleet.parameters[parameter], result.mean, result.sd);
  result.cpk = capability_index(fleet.parameters[parameter], result.mean, result.sd_within);
  result.ppk_low = result.ppk - normal_95 * std::sqrt(1.0 / (9.0 * n) +
                                                      result.ppk * result.ppk / (2.0 * (n - 1.0)));
  result.center = result.mean;
  result.below = result.mean - 3.0 * result.sd_within;
  result.above = result.mean + 3.0 * result.sd_within;
  std::vector<double> u;
  std::vector<double> with_prior;
  constexpr std::size_t least_units = 20;
  for (const FleetTest* const test : tests) {
    const double value = test->values[parameter];
    result.outside += value < result.below || value > result.above ? 1 : 0;
    const double own = test->u[parameter];
    const double noise = test->u_noise[parameter];
    if (!std::isfinite(own)) {
      continue;
    }
    u.push_back(own);
    if (batches.at(test->batch).size() >= least_units && std::isfinite(noise) && noise <= own &&
        result.sd_within > 0.0) {
      const double common2 = own * own - noise * noise;
      const double prior2 = result.sd_within * result.sd_within;
      with_prior.push_back(std::sqrt(common2 + noise * noise * prior2 / (noise * noise + prior2)));
    }
  }
  result.median_u = u.empty() ? not_a_number : upper_median(u);
  result.median_u_with_prior =
      with_prior.empty() || with_prior.size() < u.size() ? not_a_number : upper_median(with_prior);
  return result;
}

std::vector<FleetOutlier> outliers_of(const Fleet& fleet, const FleetUnits& units) {
  constexpr std::size_t least_units = 8;
  constexpr double level = 0.01;
  const double tests = static_cast<double>(units.tests.size() * fleet.parameters.size());
  if (units.tests.size() < least_units) {
    return {};
  }
  std::vector<FleetOutlier> outliers;
  for (std::size_t parameter = 0; parameter < fleet.parameters.size(); ++parameter) {
    std::map<std::string, std::vector<const FleetTest*>> batches;
    std::vector<const FleetTest*> small;
    for (auto& [name, own] : batches_of(units, parameter)) {
      if (own.size() >= least_units) {
        batches[name] = own;
      } else {
        small.insert(small.end(), own.begin(), own.end());
      }
    }
    std::vector<std::vector<const FleetTest*>> all;
    for (auto& [name, own] : batches) {
      all.push_back(std::move(own));
    }
    if (small.size() >= least_units) {
      all.push_back(std::move(small));
    }
    for (const std::vector<const FleetTest*>& batch : all) {
      const Spread spread = spread_of(values_of(batch, parameter));
      // The median absolute deviation of n values has the same uncertainty as the standard
      // deviation of 0.37 n values. The degrees of freedom are reduced by this factor.
      constexpr double efficiency = 0.37;
      const double threshold = student_t_factor(
          1.0 - level / tests, std::max(2.0, efficiency * static_cast<double>(batch.size())));
      for (const FleetTest* const test : batch) {
        const double z = (test->values[parameter] - spread.median) / spread.sd;
        if (spread.sd > 0.0 && std::abs(z) > threshold) {
          outliers.push_back({.test = test, .parameter = parameter, .z = z});
        }
      }
    }
  }
  std::stable_sort(outliers.begin(), outliers.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.z) > std::abs(b.z); });
  return outliers;
}

const char* name_of(RetestKind kind) {
  switch (kind) {
    case RetestKind::bad_test:
      return "bad test: the retest passed with other coefficients";
    case RetestKind::marginal:
      return "near a limit: the retest passed with the same coefficients";
    case RetestKind::bad_unit:
      return "bad unit: the retest failed with the same coefficients";
    case RetestKind::unstable:
      return "unstable unit: the retest also failed, but with different coefficients";
    case RetestKind::passed_both:
      return "passed both tests";
  }
  return "";
}

std::vector<Retest> retests_of(const FleetUnits& units) {
  constexpr double level = 0.01;
  std::vector<Retest> retests;
  for (const std::vector<const FleetTest*>& tests : units.tests) {
    if (tests.size() < 2) {
      continue;
    }
    Retest retest{.first = tests.front(), .last = tests.back()};
    const FleetTest& a = *retest.first;
    const FleetTest& b = *retest.last;
    std::size_t compared = 0;
    for (std::size_t k = 0; k < std::min(a.values.size(), b.values.size()); ++k) {
      const double u = std::hypot(a.u_noise[k], b.u_noise[k]);
      if (has_value(a, k) && has_value(b, k) && u > 0.0) {
        retest.largest_z = std::max(retest.largest_z, std::abs(a.values[k] - b.values[k]) / u);
        ++compared;
      }
    }
    const bool differs =
        compared == 0 ||
        retest.largest_z > normal_quantile(1.0 - level / (2.0 * static_cast<double>(compared)));
    if (a.passed) {
      retest.kind = b.passed  ? RetestKind::passed_both
                    : differs ? RetestKind::unstable
                              : RetestKind::marginal;
    } else if (b.passed) {
      retest.kind = differs ? RetestKind::bad_test : RetestKind::marginal;
    } else {
      retest.kind = differs ? RetestKind::unstable : RetestKind::bad_unit;
    }
    retests.push_back(retest);
  }
  return retests;
}

std::vector<FleetGroup> groups_of(const FleetUnits& units,
                                  const std::vector<Capability>& capabilities,
                                  const std::string FleetTest::*member) {
  std::map<std::string, std::vector<const FleetTest*>> groups;
  for (std::size_t unit = 0; unit < units.tests.size(); ++unit) {
    groups[units.last(unit).*member].push_back(&units.last(unit));
  }
  if (groups.size() < 2) {
    return {};
  }
  std::vector<FleetGroup> result;
  for (const auto& [name, tests] : groups) {
    std::size_t passed = 0;
    for (const FleetTest* const test : tests) {
      passed += test->passed ? 1 : 0;
    }
    FleetGroup group{.name = name, .passed = share_of(passed, tests.size())};
    for (std::size_t parameter = 0; parameter < capabilities.size(); ++parameter) {
      std::vector<double> values;
      for (const FleetTest* const test : tests) {
        if (has_value(*test, parameter)) {
          values.push_back(test->values[parameter]);
        }
      }
      group.z.push_back(values.empty() ? not_a_number
                                       : (mean_of(values) - capabilities[parameter].mean) *
                                             std::sqrt(static_cast<double>(values.size())) /
                                             capabilities[parameter].sd);
    }
    result.push_back(std::move(group));
  }
  return result;
}

}  // namespace axiscal
