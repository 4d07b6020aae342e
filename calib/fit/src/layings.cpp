// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/layings.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "calib/fit/src/axis_regression.hpp"

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

namespace {

using Members = std::vector<std::vector<Eigen::Index>>;  // indices of the readings of each group

// Averages the readings of each group.
// @param means  starts as the readings; receives their means.
void average(const Members& members, MeanReadings& means) {
  const ReadingSet& set = means.set();
  const Eigen::Index m = set.axis_count();
  ReadingSet all = set;
  const auto count = static_cast<Eigen::Index>(members.size());
  all.readings.clear();
  all.rotation_sensor_from_table.clear();
  all.field_then.clear();
  all.response.resize(count, m);
  all.weights.resize(count, m);
  all.effects = set.effects.of_means(members);
  for (Eigen::Index g = 0; g < count; ++g) {
    const std::vector<Eigen::Index>& rows = members[static_cast<std::size_t>(g)];
    const auto first = static_cast<std::size_t>(rows.front());
    all.readings.push_back(set.readings[first]);
    all.rotation_sensor_from_table.push_back(set.rotation_sensor_from_table[first]);
    if (!set.field_then.empty()) {
      all.field_then.push_back(set.field_then[first]);
    }
    for (Eigen::Index k = 0; k < m; ++k) {
      const Eigen::VectorXd w = set.weights(rows, k);
      const Eigen::VectorXd v = set.response(rows, k);
      const double sum = w.sum();
      const double mean = sum > 0.0 ? w.dot(v) / sum : v(0);
      all.weights(g, k) = sum;
      all.response(g, k) = mean;
      means.squares(k) += w.dot((v.array() - mean).square().matrix());
      means.degrees_of_freedom(k) +=
          std::max(static_cast<double>((w.array() > 0.0).count()) - 1.0, 0.0);
    }
  }
  means.own = std::move(all);
}

// Returns the readings as means of one reading each. Readings in estimate.unpaired get the weight
// 0.
MeanReadings readings_as_means(const ReadingSet& given, const Estimate& estimate) {
  return {.given = given,
          .own = estimate.unpaired.empty()
                     ? std::nullopt
                     : std::optional(exclude_unpaired_readings(given, estimate)),
          .squares = Eigen::VectorXd::Zero(given.axis_count()),
          .degrees_of_freedom = Eigen::VectorXd::Zero(given.axis_count())};
}

}  // namespace

MeanReadings average_layings(const ReadingSet& given, const Estimate& estimate) {
  MeanReadings means = readings_as_means(given, estimate);
  const std::vector<std::size_t> firsts = laying_starts(given);
  if (firsts.size() == given.readings.size()) {
    return means;
  }
  Members members(firsts.size());
  for (std::size_t s = 0; s < firsts.size(); ++s) {
    const std::size_t end = s + 1 < firsts.size() ? firsts[s + 1] : given.readings.size();
    members[s].resize(end - firsts[s]);
    std::iota(members[s].begin(), members[s].end(), static_cast<Eigen::Index>(firsts[s]));
  }
  average(members, means);
  return means;
}

MeanReadings average_poses(const ReadingSet& given, const Estimate& estimate) {
  MeanReadings means = readings_as_means(given, estimate);
  if (given.temperature.order > 0 || given.rotation_sensor_from_table.empty() ||
      !given.field_then.empty()) {
    return means;
  }
  const std::vector<int> group = groups_of_readings(given);
  Members members(static_cast<std::size_t>(1 + *std::max_element(group.begin(), group.end())));
  for (std::size_t i = 0; i < group.size(); ++i) {
    std::vector<Eigen::Index>& own = members[static_cast<std::size_t>(group[i])];
    const bool is_alike =
        own.empty() ||
        (given.tilt_of(i) == given.tilt_of(static_cast<std::size_t>(own.front())) &&
         given.rotation_sensor_from_table[i] ==
             given.rotation_sensor_from_table[static_cast<std::size_t>(own.front())]);
    if (!is_alike) {
      return means;
    }
    own.push_back(static_cast<Eigen::Index>(i));
  }
  if (members.size() == group.size()) {
    return means;
  }
  const auto effects = static_cast<double>(given.effects.columns.cols());
  means.own = at_reference(means.set(), estimate);
  means.own->effects = {};
  average(members, means);
  means.degrees_of_freedom = (means.degrees_of_freedom.array() - effects).max(0.0);
  return means;
}

}  // namespace axiscal
