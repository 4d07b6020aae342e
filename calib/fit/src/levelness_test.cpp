// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/levelness_test.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "axiscal/calib/deletion_fit.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "opposite_pairs.hpp"

namespace axiscal {
namespace {

constexpr double unlevel_below = 0.005;  // probability below which a face disagrees

// The half differences of one rest face in one block, as contrasts of their readings.
struct FaceContrasts {
  const OppositePair* pair = nullptr;  // the first of them
  std::vector<std::size_t> readings;
  std::vector<Eigen::RowVectorXd> rows;
};

std::vector<FaceContrasts> contrasts_by_face(const std::vector<OppositePair>& pairs) {
  std::map<std::pair<int, Face>, FaceContrasts> faces;
  for (const OppositePair& pair : pairs) {
    if (pair.level.of_all() == 0.0) {
      continue;  // no field, no slope in it
    }
    FaceContrasts& face = faces[{pair.block, pair.point.rest()}];
    face.pair = face.pair == nullptr ? &pair : face.pair;
    const auto before = static_cast<Eigen::Index>(face.readings.size());
    const auto first = static_cast<Eigen::Index>(pair.first.size());
    const auto second = static_cast<Eigen::Index>(pair.second.size());
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(before + first + second);
    row.segment(before, first).setConstant(0.5 / static_cast<double>(first));
    row.tail(second).setConstant(-0.5 / static_cast<double>(second));
    face.rows.push_back(std::move(row));
    face.readings.insert(face.readings.end(), pair.first.begin(), pair.first.end());
    face.readings.insert(face.readings.end(), pair.second.begin(), pair.second.end());
  }
  std::vector<FaceContrasts> all;
  for (auto& [key, face] : faces) {
    all.push_back(std::move(face));
  }
  return all;
}

Eigen::MatrixXd matrix_of(const FaceContrasts& face) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(face.rows.size()),
                                               static_cast<Eigen::Index>(face.readings.size()));
  for (std::size_t i = 0; i < face.rows.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)).head(face.rows[i].size()) = face.rows[i];
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
  const std::vector<OppositePair> pairs = opposite_positions(set);
  const std::vector<FaceContrasts> faces = contrasts_by_face(pairs);
  const DeletionFit others = paired ? DeletionFit(*paired, estimate.field, run.known_field())
                                    : DeletionFit(set, run.at(estimate.field));
  double smallest = 2.0;
  const FaceContrasts* suspect = nullptr;
  for (const FaceContrasts& face : faces) {
    const std::optional<double> p = others.p_value(face.readings, matrix_of(face));
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
    smallest = std::max(
        smallest,
        others.p_value_by_tails(suspect->readings, matrix_of(*suspect)).value_or(smallest));
  }
  levelness.p_value = std::min(1.0, count * smallest);
  levelness.consistent = !(levelness.p_value < unlevel_below);
  if (!levelness.consistent) {
    levelness.suspect = LevelnessEstimate{.point = suspect->pair->point,
                                          .block = suspect->pair->block,
                                          .x = not_a_number,
                                          .y = not_a_number};
  }
}

}  // namespace axiscal
