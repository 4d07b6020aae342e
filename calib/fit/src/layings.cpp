// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/layings.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace axiscal {

std::vector<std::size_t> laying_starts(const ReadingSet& set) {
  const bool may_continue =
      set.temperature.order == 0 && set.rotation_sensor_from_table.size() == set.readings.size();
  const auto continues = [&](std::size_t i) {
    const Reading& now = set.readings[i];
    const Reading& before = set.readings[i - 1];
    return may_continue && now.point == before.point && now.block == before.block &&
           now.level == before.level && set.met_of_field(i) == set.met_of_field(i - 1);
  };
  std::vector<std::size_t> firsts;
  firsts.reserve(set.readings.size());
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    if (i == 0 || !continues(i)) {
      firsts.push_back(i);
    }
  }
  return firsts;
}

Layings average_layings(const ReadingSet& given, const Estimate& estimate) {
  const Eigen::Index m = given.axis_count();
  Layings layings{.given = given,
                  .own = estimate.unpaired.empty()
                             ? std::nullopt
                             : std::optional(exclude_unpaired_readings(given, estimate)),
                  .squares = Eigen::VectorXd::Zero(m),
                  .degrees_of_freedom = Eigen::VectorXd::Zero(m)};
  const ReadingSet& set = layings.set();
  const std::vector<std::size_t> firsts = laying_starts(set);
  if (firsts.size() == set.readings.size()) {
    return layings;
  }
  std::vector<std::vector<Eigen::Index>> members(firsts.size());
  for (std::size_t s = 0; s < firsts.size(); ++s) {
    const std::size_t end = s + 1 < firsts.size() ? firsts[s + 1] : set.readings.size();
    members[s].resize(end - firsts[s]);
    std::iota(members[s].begin(), members[s].end(), static_cast<Eigen::Index>(firsts[s]));
  }
  ReadingSet means = set;
  const auto count = static_cast<Eigen::Index>(members.size());
  means.readings.clear();
  means.rotation_sensor_from_table.clear();
  means.field_then.clear();
  means.response.resize(count, m);
  means.weights.resize(count, m);
  means.effects = set.effects.of_means(members);
  for (Eigen::Index s = 0; s < count; ++s) {
    const Eigen::Index first = members[static_cast<std::size_t>(s)].front();
    const auto rows = static_cast<Eigen::Index>(members[static_cast<std::size_t>(s)].size());
    means.readings.push_back(set.readings[static_cast<std::size_t>(first)]);
    means.rotation_sensor_from_table.push_back(
        set.rotation_sensor_from_table[static_cast<std::size_t>(first)]);
    if (!set.field_then.empty()) {
      means.field_then.push_back(set.field_then[static_cast<std::size_t>(first)]);
    }
    for (Eigen::Index k = 0; k < m; ++k) {
      const Eigen::VectorXd w = set.weights.col(k).segment(first, rows);
      const Eigen::VectorXd v = set.response.col(k).segment(first, rows);
      const double sum = w.sum();
      const double mean = sum > 0.0 ? w.dot(v) / sum : v(0);
      means.weights(s, k) = sum;
      means.response(s, k) = mean;
      layings.squares(k) += w.dot((v.array() - mean).square().matrix());
      layings.degrees_of_freedom(k) +=
          std::max(static_cast<double>((w.array() > 0.0).count()) - 1.0, 0.0);
    }
  }
  layings.own = std::move(means);
  return layings;
}

}  // namespace axiscal
