// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/levelness_test.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "axiscal/calib/deletion_fit.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "groups.hpp"
#include "opposite_pairs.hpp"

namespace axiscal {
namespace {

constexpr double unlevel_below = 0.005;  // probability below which a face disagrees

// The pairs of one rest face in one block: their half differences are contrasts of their readings.
using FacePairs = std::vector<const OppositePair*>;

// By block and face.
std::vector<FacePairs> sorted_faces(const std::vector<OppositePair>& pairs) {
  const Groups by_face = pairs_by_face(pairs);
  std::vector<FacePairs> faces(by_face.size());
  for (std::size_t f = 0; f < by_face.size(); ++f) {
    faces[f].reserve(by_face[f].size());
    for (const std::size_t q : by_face[f]) {
      faces[f].push_back(&pairs[q]);
    }
  }
  std::sort(faces.begin(), faces.end(), [](const FacePairs& a, const FacePairs& b) {
    return std::pair(a.front()->block, a.front()->point.rest()) <
           std::pair(b.front()->block, b.front()->point.rest());
  });
  return faces;
}

std::vector<std::size_t> readings_of(const FacePairs& face) {
  std::vector<std::size_t> readings;
  std::size_t count = 0;
  for (const OppositePair* pair : face) {
    count += pair->first.size() + pair->second.size();
  }
  readings.reserve(count);
  for (const OppositePair* pair : face) {
    readings.insert(readings.end(), pair->first.begin(), pair->first.end());
    readings.insert(readings.end(), pair->second.begin(), pair->second.end());
  }
  return readings;
}

// @param readings  how many readings_of() there are.
Eigen::MatrixXd contrasts_of(const FacePairs& face, std::size_t readings) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(face.size()),
                                               static_cast<Eigen::Index>(readings));
  Eigen::Index at = 0;
  for (std::size_t q = 0; q < face.size(); ++q) {
    const auto first = static_cast<Eigen::Index>(face[q]->first.size());
    const auto second = static_cast<Eigen::Index>(face[q]->second.size());
    auto row = rows.row(static_cast<Eigen::Index>(q));
    row.segment(at, first).setConstant(0.5 / static_cast<double>(first));
    row.segment(at + first, second).setConstant(-0.5 / static_cast<double>(second));
    at += first + second;
  }
  return rows;
}

}  // namespace

void test_levelness(StateOfRun& run, Estimate& estimate) {
  if (!estimate.levelness) {
    return;
  }
  Levelness& levelness = *estimate.levelness;
  const ReadingSet& set = run.set();
  const std::optional<ReadingSet> paired =
      estimate.unpaired.empty() ? std::nullopt : std::optional(without_unpaired(set, estimate));
  const std::shared_ptr<const OppositePairs> pairs =
      estimate.pairs ? std::move(estimate.pairs)
                     : std::make_shared<const OppositePairs>(opposite_positions(set));
  const std::vector<FacePairs> faces = sorted_faces(pairs->pairs);
  const DeletionFit others = paired ? DeletionFit(*paired, estimate.field, run.known_field())
                                    : DeletionFit(run, estimate.field);
  double smallest = 2.0;
  const FacePairs* suspect = nullptr;
  for (const FacePairs& face : faces) {
    const std::vector<std::size_t> readings = readings_of(face);
    const std::optional<double> p = others.p_value(readings, contrasts_of(face, readings.size()));
    if (!p) {
      return;  // the other faces do not tell
    }
    if (*p < smallest) {
      smallest = *p;
      suspect = &face;
    }
  }
  if (suspect == nullptr) {
    return;
  }
  const auto count = static_cast<double>(faces.size());
  if (count * smallest < unlevel_below) {
    const std::vector<std::size_t> readings = readings_of(*suspect);
    smallest = std::max(smallest,
                        others.p_value_by_tails(readings, contrasts_of(*suspect, readings.size()))
                            .value_or(smallest));
  }
  levelness.p_value = std::min(1.0, count * smallest);
  levelness.consistent = !(levelness.p_value < unlevel_below);
  if (!levelness.consistent) {
    levelness.suspect = LevelnessEstimate{.point = suspect->front()->point,
                                          .block = suspect->front()->block,
                                          .x = not_a_number,
                                          .y = not_a_number};
  }
}

}  // namespace axiscal
