// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// The readings that a fit uses, in the instrument's terms: n readings, m axes.
struct ReadingSet {
  std::vector<Reading> readings;                            // n
  Eigen::MatrixXd response;                                 // n x m
  Eigen::MatrixXd weights;                                  // n x m, of mean 1 per axis
  std::vector<Eigen::Matrix3d> rotation_sensor_from_table;  // n; empty where readings bring fields
  std::function<Eigen::Matrix3d(const DesignPoint&)> orientation;  // the same for any point
  std::vector<std::string> axes;                                   // m names
  bool robust = false;
  // One levelness for the run, or one for each block: the blocks, and which one a reading is of.
  std::vector<int> level_blocks = {1};
  std::vector<std::size_t> levels;  // n; empty: all of the first

  [[nodiscard]] std::size_t level_of(Eigen::Index reading) const {
    return levels.empty() ? 0 : levels[static_cast<std::size_t>(reading)];
  }

  [[nodiscard]] Eigen::Index size() const { return response.rows(); }
  [[nodiscard]] Eigen::Index axis_count() const { return response.cols(); }

  /// Residuals of axis k below this are rounding.
  [[nodiscard]] double rounding(Eigen::Index k) const;

  /// The largest of them, where axes are looked at together.
  [[nodiscard]] double rounding() const;
};

/// What each method gives.
struct Estimate {
  LinearResponse response;
  std::vector<Eigen::Vector3d> fields;  // in the table, one for each levelness; empty: as readings
  FitStatistics statistics;
  std::optional<Levelness> levelness;
  std::optional<Eigen::Matrix3d> field_covariance;  // joint: of the fields' mean
  double field_degrees_of_freedom = 0.0;
  double mean_field = 0.0;            // known by fx,fy,fz: mean length of the fields given
  double direction_se_rad = 0.0;      // joint: the larger standard error of the field's direction
  std::vector<std::size_t> unpaired;  // paired: readings without their opposite, left out
};

/// Averages of opposite positions, the measured tilt put back in (METHOD 4).
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

/// All readings, the field's direction in the table unknown (METHOD 4).
/// @param start_in_table  the field; its length F and, as a start, its direction are used.
[[nodiscard]] Estimate estimate_joint(const ReadingSet& set, const Eigen::Vector3d& start_in_table);

/// The field known for each reading (METHOD 4).
/// @param in_table  the field; none where the readings bring theirs.
[[nodiscard]] Estimate estimate_known(const ReadingSet& set,
                                      const std::optional<Eigen::Vector3d>& in_table);

/// Rows [1, f_i] of the regression for the fields in the table, one for each levelness; n x 4.
[[nodiscard]] Eigen::MatrixXd field_design(const ReadingSet& set,
                                           const std::vector<Eigen::Vector3d>& fields);

/// "x.bias", "x.sensitivity.x", ... for all axes.
[[nodiscard]] std::vector<std::string> parameter_names(const std::vector<std::string>& axes);

/// The same for the columns [1, f] that are open, for all axes.
[[nodiscard]] std::vector<std::string> names_of_columns(const std::vector<std::string>& axes,
                                                        const std::vector<Eigen::Index>& columns);

}  // namespace axiscal
