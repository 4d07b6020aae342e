// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

struct Solution;

/// The test whether the responses of the axes bend.
struct CurvatureTest {
  double p_value = 1.0;   ///< of so large a bend by chance
  Eigen::VectorXd bends;  ///< m: the term in the squared field along each axis at full field [unit]
};

/// Polynomials of bias and scale in the temperature (method.md, section 6).
struct TemperatureEstimate {
  Eigen::MatrixXd bias;   ///< m x order
  Eigen::MatrixXd scale;  ///< m x order
};

/// The field's direction as method joint fits it.
struct DirectionEstimate {
  std::optional<Eigen::Matrix3d> covariance;  ///< of the mean field in the table
  double degrees_of_freedom = 0.0;
  double se_rad = 0.0;    ///< the larger standard error
  std::string ambiguity;  ///< another solution that fits as well, in words; empty: none
};

/// Differences between blocks, and the conditions that they cover.
struct BlockEstimate {
  Eigen::VectorXd mean_square;      ///< m: of the blocks' biases about their mean; or empty
  double degrees_of_freedom = 0.0;  ///< of each
  SensitivityMatrix sensitivity_mean_square = SensitivityMatrix(0, 3);  ///< m rows, or none
  double sensitivity_degrees_of_freedom = 0.0;                          ///< of each
  int sessions = 0;  ///< sessions that were fitted one by one; 0: all readings at once
  int earlier = 0;   ///< earlier calibrations whose scatter of blocks counts
};

/// The part of the field that axes see.
struct SightEstimate {
  Eigen::Matrix3Xd seen = Eigen::Matrix3Xd(3, 0);  ///< of a transfer, as seen_directions()
  std::vector<AxisMask> visible;  ///< for one-sided axes under several lights; see ReadingSet
  bool unsettled = false;  ///< true if the set of readings seen by one-sided axes keeps changing
};

/// The result of a method.
struct Estimate {
  LinearResponse response;
  std::vector<SensitivityMatrix> also;  ///< one for each second field
  TemperatureEstimate temperature;
  Eigen::MatrixXd effects;  ///< e x m: coefficients of the run's effects
  TableField field;         ///< as fitted; without vectors if the readings bring their fields
  DirectionEstimate direction;
  FitStatistics statistics;
  std::optional<Levelness> levelness;
  BlockEstimate blocks;
  SightEstimate sight;
  double mean_field = 0.0;            ///< mean length of the fields that the readings bring
  std::vector<std::size_t> unpaired;  ///< paired: readings without their opposite, left out
  std::optional<CurvatureTest> curvature;
  std::vector<CalibrationNote> notes;
  std::shared_ptr<const Solution> solution;  ///< at the field, if the method kept it
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

/// Fits all readings with the field's direction in the table unknown (method.md, section 4). The
/// search starts from the known fields of the set.
[[nodiscard]] Estimate estimate_joint(const ReadingSet& set);

/// The field known for each reading (method.md, section 4).
/// @param field  with its vectors; without them where the readings bring theirs.
[[nodiscard]] Estimate estimate_known(const ReadingSet& set, const TableField& field);

/// The set as it would have been read at the reference temperature, in the middle of the run.
[[nodiscard]] ReadingSet at_reference(ReadingSet set, const Estimate& estimate);

/// The set, with weight 0 for the readings that method paired left out.
[[nodiscard]] ReadingSet exclude_unpaired_readings(ReadingSet set, const Estimate& estimate);

/// Takes what the columns of an axis's regression say into the estimate.
void set_coefficients(const ReadingSet& set,
                      Eigen::Index axis,
                      const Eigen::VectorXd& coefficients,
                      Estimate& estimate);

}  // namespace axiscal
