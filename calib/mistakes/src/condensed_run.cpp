// SPDX-License-Identifier: Apache-2.0
#include "calib/mistakes/src/condensed_run.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "calib/fit/run_effects.hpp"

namespace axiscal {
namespace {

// Readings are averaged only if they have the same design point, mount, level, slope of the table
// and temperature level (soak). The slope and the soak are included, because the model has separate
// terms for each of them.
using Pose = std::tuple<std::optional<DesignPoint>, int, FieldLevel, std::size_t, int>;

Pose pose_of(const ReadingSet& set, std::size_t i) {
  const Reading& reading = set.readings[i];
  return {reading.point, reading.mount, reading.level, set.tilt_of(i), set.soak_of(i)};
}

// Returns the groups of readings to average; each group is a list of indices of readings. The run
// is divided into parts of equal length. A group contains the readings of one part that have the
// same pose. Returns no groups if the run has more than `most` different poses.
std::vector<std::vector<Eigen::Index>> groups_of(const ReadingSet& set, std::size_t most) {
  std::set<Pose> poses;
  for (std::size_t i = 0; i < set.readings.size() && poses.size() <= most; ++i) {
    poses.insert(pose_of(set, i));
  }
  if (poses.size() > most) {
    return {};
  }
  const std::vector<std::size_t> order = order_of_runs(set.readings);
  const std::size_t parts = std::max<std::size_t>(1, most / poses.size());
  std::map<std::pair<std::size_t, Pose>, std::size_t> places;
  std::vector<std::vector<Eigen::Index>> groups;
  for (std::size_t at = 0; at < order.size(); ++at) {
    const auto [found, is_new] =
        places.try_emplace({at * parts / order.size(), pose_of(set, order[at])}, groups.size());
    if (is_new) {
      groups.emplace_back();
    }
    groups[found->second].push_back(static_cast<Eigen::Index>(order[at]));
  }
  return groups;
}

}  // namespace

std::optional<ReadingSet> condensed(const ReadingSet& set, std::size_t most) {
  const std::vector<std::vector<Eigen::Index>> groups = groups_of(set, most);
  if (groups.empty() || !set.visible.empty()) {
    return std::nullopt;
  }
  const auto n = static_cast<Eigen::Index>(groups.size());
  ReadingSet few = set;
  few.readings.clear();
  few.rotation_sensor_from_table.clear();
  few.field_then.clear();
  few.temperature.soak.clear();
  few.response.resize(n, set.axis_count());
  few.weights.resize(n, set.axis_count());
  few.temperature.d.resize(set.temperature.d.rows() > 0 ? n : 0, set.temperature.d.cols());
  few.effects = set.effects.of_means(groups);
  for (Eigen::Index g = 0; g < n; ++g) {
    const std::vector<Eigen::Index>& members = groups[static_cast<std::size_t>(g)];
    const auto first = static_cast<std::size_t>(members.front());
    const auto count = static_cast<double>(members.size());
    few.readings.push_back(set.readings[first]);
    few.rotation_sensor_from_table.push_back(set.rotation_sensor_from_table[first]);
    const auto weights = set.weights(members, Eigen::all).array().eval();
    few.weights.row(g) = weights.colwise().sum();
    few.response.row(g) = (weights * set.response(members, Eigen::all).array()).colwise().sum() /
                          few.weights.row(g).array();
    if (few.temperature.d.rows() > 0) {
      few.temperature.d.row(g) = set.temperature.d(members, Eigen::all).colwise().mean();
    }
    if (!set.temperature.soak.empty()) {
      few.temperature.soak.push_back(set.temperature.soak[first]);
    }
    if (!set.field_then.empty()) {
      Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
      for (const Eigen::Index i : members) {
        sum += set.field_then[static_cast<std::size_t>(i)];
      }
      few.field_then.emplace_back(sum / count);
    }
  }
  for (Eigen::Index k = 0; k < few.weights.cols(); ++k) {
    few.weights.col(k) /= few.weights.col(k).mean();
  }
  return few;
}

}  // namespace axiscal
