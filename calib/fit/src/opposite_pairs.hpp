// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/src/groups.hpp"

namespace axiscal {

/// The readings of two opposite positions: the same rest face and opposite fence faces, so the cube
/// is turned by 180 degrees on the table.
struct OppositePair {
  DesignPoint point;  // the common rest face, and the positive one of the two fence faces
  int block = 1;
  FieldLevel level;
  int soak = 0;                         // index of the temperature level of the readings
  std::size_t levelness = 0;            // index of the table's slope, from ReadingSet::tilt_of()
  std::span<const std::size_t> first;   // indices of the readings at `point`
  std::span<const std::size_t> second;  // indices of the readings with the opposite fence face
  // The next three members have m entries each; they are empty if averages were not computed. v_a
  // and v_b are the mean readings of `first` and `second`; w_a and w_b are the sums of the weights.
  Eigen::Map<const Eigen::VectorXd> mean{nullptr, 0};             // (v_a + v_b) / 2
  Eigen::Map<const Eigen::VectorXd> half_difference{nullptr, 0};  // (v_a - v_b) / 2
  // The weight of `mean`: 4 / (1/w_a + 1/w_b).
  Eigen::Map<const Eigen::VectorXd> weights{nullptr, 0};
  Eigen::Matrix3d mean_rotation =
      Eigen::Matrix3d::Zero();  // (R_a + R_b) / 2; R_a and R_b are means of
                                // ReadingSet::met_of_field() over repeats
  Eigen::Matrix3d half_rotation = Eigen::Matrix3d::Zero();  // (R_a - R_b) / 2
};

/// The pairs of opposite positions. The readings of a pair have the same block, level and
/// temperature; repeats are averaged.
struct OppositePairs {
  std::vector<OppositePair> pairs;    // ordered by the first reading of each pair
  std::vector<std::size_t> unpaired;  // indices of the readings that have no opposite reading
  // The arrays to which the spans and maps of the pairs point.
  std::vector<std::size_t> readings;
  Eigen::MatrixXd averages;  // m x 3 for each pair: its mean, half_difference and weights

  OppositePairs() = default;
  OppositePairs(OppositePairs&&) = default;
  OppositePairs& operator=(OppositePairs&&) = default;
  OppositePairs(const OppositePairs&) = delete;
  OppositePairs& operator=(const OppositePairs&) = delete;
  ~OppositePairs() = default;
};

[[nodiscard]] OppositePairs find_opposite_pairs(const ReadingSet& set);

/// @return the pairs of find_opposite_pairs() with their readings, without averages and rotations.
[[nodiscard]] OppositePairs opposite_positions(const ReadingSet& set);

/// @return the pairs grouped by block and rest face, without pairs at level 0. Their half
///         differences determine the slope.
[[nodiscard]] Groups pairs_by_face(const std::vector<OppositePair>& pairs);

/// Computes the field's components in the table's plane from the half differences (method.md,
/// section 5).
///
/// @param field  the fitted field, with one vector for each slope of the table. The component along
///               the normal cancels in the differences only if the field is constant.
/// @param F      magnitude of the field at level 1.
/// @return nullopt if the differences do not determine both components of each slope.
[[nodiscard]] std::optional<Levelness> estimate_levelness(const ReadingSet& set,
                                                          const std::vector<OppositePair>& pairs,
                                                          const SensitivityMatrix& sensitivity,
                                                          const TableField& field,
                                                          double F);

/// Like estimate_levelness(), with the sensitivity and the field of an estimate, and with readings
/// that are corrected to the reference temperature.
/// @param pairs  the opposite pairs of `set`.
[[nodiscard]] std::optional<Levelness> levelness_of(const ReadingSet& set,
                                                    const std::vector<OppositePair>& pairs,
                                                    const Estimate& estimate,
                                                    double F);

/// Finds the opposite pairs, computes the slope of the table from them, and stores it in the
/// estimate.
/// @param F  magnitude of the field.
void put_levelness(const ReadingSet& set, double F, Estimate& estimate);

}  // namespace axiscal
