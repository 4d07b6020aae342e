// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/reading_set.hpp"

namespace axiscal {

struct Solution;
struct OppositePairs;

/// Whether the axes' responses bend.
struct CurvatureTest {
  double p_value = 1.0;   // that they seem to bend so much by chance
  Eigen::VectorXd bends;  // m: what the squared field along each axis adds at full field [unit]
};

/// An axis that reads its largest or smallest value several times, short of what it should.
struct SaturatedAxis {
  Eigen::Index axis = 0;
  double value = 0.0;     // [unit]
  std::vector<int> runs;  // that read so
};

/// What each method gives.
struct Estimate {
  std::vector<SaturatedAxis> saturated;
  LinearResponse response;
  std::vector<SensitivityMatrix> also;  // one for each second field
  Eigen::MatrixXd temperature_bias;     // m x order, method.md, section 6
  Eigen::MatrixXd temperature_scale;
  Eigen::MatrixXd effects;  // e x m: what the columns of the run's effects came to
  TableField field;         // as fitted; without vectors: as the readings bring it
  FitStatistics statistics;
  std::optional<Levelness> levelness;
  std::optional<Eigen::Matrix3d> field_covariance;  // joint: of the fields' mean
  double field_degrees_of_freedom = 0.0;
  Eigen::Matrix3Xd seen = Eigen::Matrix3Xd(3, 0);  // of a transfer, as seen_directions()
  std::vector<AxisMask> visible;  // of one-sided axes under several lights, as ReadingSet has it
  double mean_field = 0.0;        // known by fx,fy,fz: mean length of the fields given
  bool field_varies = false;      // known by fx,fy,fz: they are of different lengths
  double direction_se_rad = 0.0;  // joint: the larger standard error of the field's direction
  std::vector<std::size_t> unpaired;  // paired: readings without their opposite, left out
  bool unsettled = false;             // one-sided axes: which readings they see does not settle
  std::optional<CurvatureTest> curvature;
  Eigen::VectorXd block_mean_square;      // m: of the blocks' biases about their mean; or empty
  double block_degrees_of_freedom = 0.0;  // of each
  SensitivityMatrix sensitivity_mean_square = SensitivityMatrix(0, 3);  // of the blocks; m rows
  double sensitivity_degrees_of_freedom = 0.0;                          // of each
  int sessions = 0;                       // that were fitted each alone; 0: all readings at once
  int earlier = 0;                        // earlier calibrations whose scatter of blocks counts
  std::vector<CalibrationNote> notes;     // remarks that ask for nothing
  std::string ambiguity;                  // joint: two solutions that fit alike, in words
  std::shared_ptr<const Solution> state;  // what the set comes to at the field, if kept
  std::shared_ptr<const OppositePairs> pairs;  // of the set, if they were kept
};

/// Averages of opposite positions, the measured tilt put back in (method.md, section 4).
/// @param nominal_in_table  the field; its length F and the sign of its z are used.
[[nodiscard]] Estimate estimate_paired(const ReadingSet& set,
                                       const Eigen::Vector3d& nominal_in_table);

/// The averages that `paired` regresses on, for readings of equal weight.
struct PairedDesign {
  Eigen::MatrixXd design;     // [1, mean f], q x 4
  Eigen::MatrixXd averaging;  // q x n: the averages of the readings
  Eigen::VectorXd weights;    // q
};
[[nodiscard]] PairedDesign paired_design(const ReadingSet& set, const Eigen::Vector3d& in_table);

/// All readings, the field's direction in the table unknown (method.md, section 4). It starts from
/// what is known of the set's field.
[[nodiscard]] Estimate estimate_joint(const ReadingSet& set);

/// The field known for each reading (method.md, section 4).
/// @param field  with its vectors; without them where the readings bring theirs.
[[nodiscard]] Estimate estimate_known(const ReadingSet& set, const TableField& field);

/// The set as it would have been read at the reference temperature, in the middle of the run.
[[nodiscard]] ReadingSet at_reference(ReadingSet set, const Estimate& estimate);

/// The set with weight 0 for what method paired left out.
[[nodiscard]] ReadingSet without_unpaired(ReadingSet set, const Estimate& estimate);

/// Takes what the columns of an axis's regression say into the estimate.
void set_coefficients(const ReadingSet& set,
                      Eigen::Index axis,
                      const Eigen::VectorXd& coefficients,
                      Estimate& estimate);

}  // namespace axiscal
