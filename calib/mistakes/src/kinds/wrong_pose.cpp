// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <exception>
#include <string>
#include <utility>

#include "axiscal/positioner/design.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::array wrong_pose_advice = {MistakeAdvice{
    .code = WarningCode::wrong_pose, .one = "Check the face, or take the reading again."}};

// A design point is less likely by this factor if the block already contains it, or if the block
// does not contain the point with the same rest face and the opposite fence face.
constexpr double repeated_point = 5.0;

// Returns the words for a wrong pose, for example "rest -Y instead of +Y (upside down)".
std::string pose_words(const DesignPoint& stated, const DesignPoint& point, bool has_fence) {
  const auto face = [](Face f) { return std::string(face_name(f)); };
  const bool same_rest = stated.rest() == point.rest();
  const bool same_fence = !has_fence || stated.fence() == point.fence();
  if (same_fence) {
    return formatted("rest {} instead of {}{}", face(point.rest()), face(stated.rest()),
                     axis_of(point.rest()) == axis_of(stated.rest()) ? " (upside down)" : "");
  }
  if (same_rest) {
    return formatted(
        "fence {} instead of {}{}", face(point.fence()), face(stated.fence()),
        axis_of(point.fence()) == axis_of(stated.fence()) ? " (the wrong way round)" : "");
  }
  return formatted("rest {}, fence {} instead of rest {}, fence {}", face(point.rest()),
                   face(point.fence()), face(stated.rest()), face(stated.fence()));
}

void explain_by_pose(const SuspectRun& run, std::size_t i, Explanations& found) {
  const DesignPoint& stated = *run.set().readings[i].point;
  const HypothesisFit& without = run.without(i);
  if (!without.fitted) {
    return;
  }
  const auto row = static_cast<Eigen::Index>(i);
  // Only the poses nearest to the prediction by the other readings are fitted.
  std::vector<std::pair<double, DesignPoint>> poses;
  for (const DesignEntry& entry : standard_design(24)) {
    // If the run states no fence faces, all design points with the same rest face are equivalent.
    const bool is_same = run.set().has_fence
                             ? entry.point == stated
                             : entry.point.rest() == stated.rest() ||
                                   std::any_of(poses.begin(), poses.end(), [&](const auto& pose) {
                                     return pose.second.rest() == entry.point.rest();
                                   });
    if (is_same) {
      continue;
    }
    ReadingSet moved = one_reading(run.set(), i);
    try {
      moved.rotation_sensor_from_table = {run.set().orientation(entry.point)};
    } catch (const std::exception&) {
      continue;  // the cube cannot lie in this pose
    }
    poses.emplace_back(distance_squared(run, moved, without, run.set().response.row(row)),
                       entry.point);
  }
  std::stable_sort(poses.begin(), poses.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  constexpr std::size_t near = 3;
  for (std::size_t at = 0; at < std::min(near, poses.size()); ++at) {
    const DesignPoint& point = poses[at].second;
    ReadingSet set = run.set();
    set.readings[i].point = point;
    set.rotation_sensor_from_table.put(i, run.set().orientation(point));
    Correction correction = about(run, WarningCode::wrong_pose, {i});
    correction.points = {{run.run_of(i), point}};
    const bool is_odd = run.set().has_fence &&
                        (std::any_of(run.set().readings.begin(), run.set().readings.end(),
                                     [&](const Reading& reading) {
                                       return reading.block == run.set().readings[i].block &&
                                              reading.point == point;
                                     }) ||
                         std::none_of(run.set().readings.begin(), run.set().readings.end(),
                                      [&](const Reading& reading) {
                                        return reading.block == run.set().readings[i].block &&
                                               reading.point == point.turned_round();
                                      }));
    // On a level table the readings depend little on the fence face, so they hardly distinguish
    // design points with the same rest face. A usual block contains each design point once, and
    // also contains the point with the opposite fence face. Points that would break this pattern
    // are therefore less likely.
    const double alternatives =
        !run.set().has_fence ? 5.0 : (is_odd ? 23.0 * repeated_point : 23.0);
    found.add(run.fitter().fit(set), {}, alternatives * static_cast<double>(run.n()),
              std::move(correction), "as " + pose_words(stated, point, run.set().has_fence));
  }
}

}  // namespace

MistakeKind wrong_pose_kind() {
  return {.advice = wrong_pose_advice, .of_reading = explain_by_pose};
}

}  // namespace axiscal
