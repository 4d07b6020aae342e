// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "axiscal/calib/estimation.hpp"

namespace axiscal {

/// The readings of two opposite positions: one rest face, turned by 180 degrees.
struct OppositePair {
  DesignPoint point;  // rest face with the positive fence face
  int block = 1;
  FieldLevel level;
  int soak = 0;                     // which soak level the readings were taken at
  std::size_t levelness = 0;        // which one it is of, as ReadingSet::tilt_of()
  std::vector<std::size_t> first;   // readings at `point`
  std::vector<std::size_t> second;  // readings turned round
  Eigen::VectorXd mean;             // (v_a + v_b) / 2, m entries
  Eigen::VectorXd half_difference;  // (v_a - v_b) / 2
  Eigen::VectorXd weights;          // each axis's, relative to one reading: 4 / (1/w_a + 1/w_b)
  Eigen::Matrix3d mean_rotation =
      Eigen::Matrix3d::Zero();  // (R_a + R_b) / 2, as ReadingSet::met_of_field(), means of repeats
  Eigen::Matrix3d half_rotation = Eigen::Matrix3d::Zero();  // (R_a - R_b) / 2
};

/// Pairs within blocks and levels, repeats averaged; and the readings that have no opposite.
struct OppositePairs {
  std::vector<OppositePair> pairs;  // in the order of their first reading
  std::vector<std::size_t> unpaired;
};

[[nodiscard]] OppositePairs find_opposite_pairs(const ReadingSet& set);

/// @return the pairs that it finds, which readings they are of and no more.
[[nodiscard]] std::vector<OppositePair> opposite_positions(const ReadingSet& set);

/// The field's components in the table's plane from the half differences (method.md, section 5).
///
/// @param fields  as fitted, one for each levelness: what is along the normal drops out of the
///                differences only where the field does not move.
/// @param F  magnitude of the field at level 1.
/// @return nothing where the differences do not determine both components of each levelness.
[[nodiscard]] std::optional<Levelness> estimate_levelness(const ReadingSet& set,
                                                          const std::vector<OppositePair>& pairs,
                                                          const SensitivityMatrix& sensitivity,
                                                          const TableField& field,
                                                          double F);

/// The same for what a fit gave, the readings taken to the reference temperature.
/// @param pairs  of the set.
[[nodiscard]] std::optional<Levelness> levelness_of(const ReadingSet& set,
                                                    const std::vector<OppositePair>& pairs,
                                                    const Estimate& estimate,
                                                    double F);

/// Finds the pairs, puts the levelness into the estimate, and keeps them there but for a long run,
/// of which memory is dearer than another look.
void put_levelness(const ReadingSet& set, double F, Estimate& estimate);

/// The same for pairs that are known.
void keep_pairs(const ReadingSet& set, std::vector<OppositePair> pairs, Estimate& estimate);

}  // namespace axiscal
