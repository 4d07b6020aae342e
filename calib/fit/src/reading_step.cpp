// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reading_step.hpp"

#include <algorithm>
#include <cmath>

namespace axiscal {
namespace {

// Whether readings differ by whole steps.
bool are_multiples(const std::vector<double>& readings, double step) {
  return std::all_of(readings.begin(), readings.end(), [&](double reading) {
    const double steps = (reading - readings.front()) / step;
    constexpr double whole = 1e-3;
    return std::abs(steps - std::round(steps)) <= whole;
  });
}

}  // namespace

std::optional<double> step_of_readings(std::vector<double> readings, double stated_step) {
  if (stated_step > 0.0 && are_multiples(readings, stated_step)) {
    return stated_step;
  }
  const std::size_t count = readings.size();
  std::sort(readings.begin(), readings.end());
  readings.erase(std::unique(readings.begin(), readings.end()), readings.end());
  // Where hardly a reading comes twice there is no step that matters.
  constexpr double most_unique = 0.9;
  if (readings.size() < 2 ||
      static_cast<double>(readings.size()) > most_unique * static_cast<double>(count)) {
    return std::nullopt;
  }
  const double largest = std::max(std::abs(readings.front()), std::abs(readings.back()));
  double step = readings.back() - readings.front();
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const double difference = readings[i] - readings[i - 1];
    // Decimals are not exact: what differs by less is the same.
    constexpr double same = 1e-12;
    step = difference > same * largest ? std::min(step, difference) : step;
  }
  return are_multiples(readings, step) ? std::optional(step) : std::nullopt;
}

}  // namespace axiscal
