// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/levelness_test.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "axiscal/core/not_a_number.hpp"
#include "calib/fit/deletion_fit.hpp"
#include "calib/fit/src/groups.hpp"
#include "calib/fit/src/opposite_pairs.hpp"

namespace axiscal {
namespace {

constexpr double unlevel_below = 0.005;  // probability below which a face disagrees

// The pairs of opposite positions (opposite fence faces) of one rest face in one block. The half
// differences of a pair are contrasts of its readings.
using FacePairs = std::vector<const OppositePair*>;

// Returns the pairs of each face, sorted by block and rest face.
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

// The readings of a face, and a matrix that maps them to half differences, one row for each pair.
// One object is used for all faces in turn, to save memory.
struct FaceContrasts {
  void take(const FacePairs& face) {
    readings.clear();
    for (const OppositePair* pair : face) {
      readings.insert(readings.end(), pair->first.begin(), pair->first.end());
      readings.insert(readings.end(), pair->second.begin(), pair->second.end());
    }
    rows.setZero(static_cast<Eigen::Index>(face.size()),
                 static_cast<Eigen::Index>(readings.size()));
    Eigen::Index at = 0;
    for (std::size_t q = 0; q < face.size(); ++q) {
      const auto first = static_cast<Eigen::Index>(face[q]->first.size());
      const auto second = static_cast<Eigen::Index>(face[q]->second.size());
      auto row = rows.row(static_cast<Eigen::Index>(q));
      row.segment(at, first).setConstant(0.5 / static_cast<double>(first));
      row.segment(at + first, second).setConstant(-0.5 / static_cast<double>(second));
      at += first + second;
    }
  }

  std::vector<std::size_t> readings;
  Eigen::MatrixXd rows;
};

}  // namespace

void test_levelness(const SolvedReadings& run, Estimate& estimate) {
  // The test gives all readings the same weight, so a reading of robust weight 0 would make it
  // fail.
  if (!estimate.levelness || run.set().robust) {
    return;
  }
  Levelness& levelness = *estimate.levelness;
  const ReadingSet& set = run.set();
  const std::optional<ReadingSet> paired =
      estimate.unpaired.empty() ? std::nullopt
                                : std::optional(exclude_unpaired_readings(set, estimate));
  const OppositePairs pairs = opposite_positions(set);
  const std::vector<FacePairs> faces = sorted_faces(pairs.pairs);
  const DeletionFit others = paired ? DeletionFit(*paired, estimate.field, run.known_field())
                                    : DeletionFit(run, estimate.field);
  const auto count = static_cast<double>(faces.size());
  double smallest = 1.0 / count;  // count * smallest, the p-value of all faces, starts at 1
  bool tell = false;
  const FacePairs* suspect = nullptr;
  FaceContrasts contrasts;
  for (const FacePairs& face : faces) {
    contrasts.take(face);
    const std::optional<double> p = others.p_value(contrasts.readings, contrasts.rows);
    if (!p) {
      return;  // the other readings do not determine the prediction
    }
    tell = tell || !std::isnan(*p);
    if (*p < smallest) {
      smallest = *p;
      suspect = &face;
    }
  }
  if (!tell) {
    return;
  }
  if (suspect != nullptr && count * smallest < unlevel_below) {
    contrasts.take(*suspect);
    smallest = std::max(
        smallest, others.p_value_by_tails(contrasts.readings, contrasts.rows).value_or(smallest));
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
