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

/// A test for curvature of the axes' responses.
struct CurvatureTest {
  double p_value = 1.0;  ///< probability that chance alone causes a curvature of this size
  /// m entries: the contribution of the squared term to the reading of each axis, at the full
  /// magnitude of the field [unit]
  Eigen::VectorXd bends;
};

/// Polynomials of bias and scale in the temperature (method.md, section 6).
struct TemperatureEstimate {
  Eigen::MatrixXd bias;   ///< m x order
  Eigen::MatrixXd scale;  ///< m x order
};

/// The direction of the field, fitted by method `joint`.
struct DirectionEstimate {
  /// covariance of the mean field vector, in the table's frame [field unit^2]
  std::optional<Eigen::Matrix3d> covariance;
  double degrees_of_freedom = 0.0;
  double se_rad = 0.0;  ///< largest standard error of the direction
  /// another solution that fits equally well, in words; empty if there is none
  std::string ambiguity;
};

/// The differences between blocks, and the numbers of sessions and earlier calibrations.
struct BlockEstimate {
  /// m entries: mean squared deviation of the blocks' biases from their mean; empty if not computed
  Eigen::VectorXd mean_square;
  double degrees_of_freedom = 0.0;  ///< degrees of freedom of each mean square
  /// mean squared deviation of the blocks' sensitivities from their mean; m x 3, or 0 x 3 if not
  /// computed
  SensitivityMatrix sensitivity_mean_square = SensitivityMatrix(0, 3);
  /// degrees of freedom of each mean square of the sensitivities
  double sensitivity_degrees_of_freedom = 0.0;
  /// number of sessions that were fitted separately; 0 if all readings were fitted together
  int sessions = 0;
  int earlier = 0;  ///< number of earlier calibrations whose block scatter is included
};

/// The parts of the field that the axes respond to.
struct SightEstimate {
  Eigen::Matrix3Xd seen = Eigen::Matrix3Xd(3, 0);  ///< see seen_directions(); usually empty
  std::vector<AxisMask> visible;                   ///< for one-sided axes; see ReadingSet::visible
  /// true if the search for the readings that each one-sided axis uses did not converge
  bool unsettled = false;
};

/// The result of a method.
struct Estimate {
  LinearResponse response;
  std::vector<SensitivityMatrix> also;  ///< sensitivities to each second field (Experiment::also)
  TemperatureEstimate temperature;
  Eigen::MatrixXd effects;  ///< e x m: coefficients of the columns in ReadingSet::effects
  /// fitted or given field; without vectors if each reading has its own given field
  TableField field;
  DirectionEstimate direction;
  FitStatistics statistics;
  std::optional<Levelness> levelness;
  BlockEstimate blocks;
  SightEstimate sight;
  /// mean magnitude of the field, over the readings at which it is not 0; 0 if the method does not
  /// compute it
  double mean_field = 0.0;
  /// for method `paired`: indices of the readings that have no opposite reading and are not used
  std::vector<std::size_t> unpaired;
  std::optional<CurvatureTest> curvature;
  std::vector<CalibrationNote> notes;
  /// the solved model at `field`; null if the method did not keep it
  std::shared_ptr<const Solution> solution;
};

/// Method `paired`: fits the averages of opposite readings, which have the same rest face and
/// opposite fence faces. The field is rotated by the measured tilt of the table (method.md, section
/// 4).
/// @param nominal_in_table  nominal field; only its magnitude and the sign of its component z are
///                          used.
[[nodiscard]] Estimate estimate_paired(const ReadingSet& set,
                                       const Eigen::Vector3d& nominal_in_table);

/// The regression that the method `paired` makes for the averages of opposite readings, if all
/// readings have equal weight.
struct PairedDesign {
  Eigen::MatrixXd design;     // q x 4: 1, then the mean field in the sensor's frame
  Eigen::MatrixXd averaging;  // q x n: maps the readings to the averages
  Eigen::VectorXd weights;    // q
};
[[nodiscard]] PairedDesign paired_design(const ReadingSet& set, const Eigen::Vector3d& in_table);

/// Method `joint`: fits all readings and the unknown direction of the field in the table
/// (method.md, section 4). The search starts from start_fields().
[[nodiscard]] Estimate estimate_joint(const ReadingSet& set);

/// Method `known`: fits readings whose fields are known (method.md, section 4).
/// @param field  the field in the table's frame; without vectors if each reading has its own given
///               field.
[[nodiscard]] Estimate estimate_known(const ReadingSet& set, const TableField& field);

/// Returns the set with its readings corrected to the reference temperature, and without the fitted
/// effects of the run.
[[nodiscard]] ReadingSet at_reference(ReadingSet set, const Estimate& estimate);

/// Returns the set with weight 0 for the readings in Estimate::unpaired.
[[nodiscard]] ReadingSet exclude_unpaired_readings(ReadingSet set, const Estimate& estimate);

/// Stores the regression coefficients of an axis in the estimate.
void set_coefficients(const ReadingSet& set,
                      Eigen::Index axis,
                      const Eigen::VectorXd& coefficients,
                      Estimate& estimate);

}  // namespace axiscal
