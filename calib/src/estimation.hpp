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

/// The temperature terms of the axes while they are fitted (METHOD 6). The product of scale and
/// field is linear in the changes of its factors: columns d^j (S f) beside scale(t) f.
struct TemperatureTerms {
  int order = 0;
  Eigen::VectorXd d;        // n: t - reference
  std::vector<int> soak;    // n: number of the soak level; empty where temperatures are continuous
  Eigen::MatrixXd scale;    // m x order: what is known of c
  SensitivityMatrix along;  // m x 3: S as far as known; at first the main axis alone [P]
};

/// The readings that a fit uses, in the instrument's terms: n readings, m axes.
struct ReadingSet {
  std::vector<Reading> readings;                            // n
  Eigen::MatrixXd response;                                 // n x m
  Eigen::MatrixXd weights;                                  // n x m, of mean 1 per axis
  std::vector<Eigen::Matrix3d> rotation_sensor_from_table;  // n; empty where readings bring fields
  std::function<Eigen::Matrix3d(const DesignPoint&)> orientation;  // the same for any point
  std::vector<std::string> axes;                                   // m names
  std::vector<std::optional<int>> nominal;  // the component each axis is meant to sense; or empty
  // The parts of the field; one that its level multiplies, unless it is a sum.
  std::vector<FieldPartDescription> parts = std::vector<FieldPartDescription>(1);
  bool level_can_be_set = true;  // some part is made on the table
  // Second fields, known in the table, which no level changes: three more columns each.
  std::vector<std::string> also_kinds;
  std::vector<Eigen::Vector3d> also_in_table;
  Eigen::VectorXd noise_ratio;  // m: stated; empty where it is not known
  bool robust = false;
  TemperatureTerms temperature;
  // One levelness for the run, or one for each block: the blocks, and which one a reading is of.
  std::vector<int> level_blocks = {1};
  std::vector<std::size_t> levels;  // n; empty: all of the first

  [[nodiscard]] std::size_t level_of(Eigen::Index reading) const {
    return levels.empty() ? 0 : levels[static_cast<std::size_t>(reading)];
  }

  [[nodiscard]] int soak_of(std::size_t reading) const {
    return temperature.soak.empty() ? 0 : temperature.soak[reading];
  }

  // The columns [1, f, second fields, d, .., d S f, ..] of the regression of an axis.
  [[nodiscard]] Eigen::Index column_count() const {
    return base_column_count() + 2 * temperature.order;
  }
  [[nodiscard]] Eigen::Index base_column_count() const {
    return 4 + 3 * static_cast<Eigen::Index>(also_in_table.size());
  }

  // Columns [1, f, second fields] of an axis with those of temperature; all readings, and one row.
  [[nodiscard]] Eigen::MatrixXd with_temperature(const Eigen::MatrixXd& design,
                                                 Eigen::Index axis) const;
  [[nodiscard]] Eigen::RowVectorXd with_temperature(const Eigen::RowVectorXd& row,
                                                    Eigen::Index reading,
                                                    Eigen::Index axis) const;

  // 1 + c_1 d + ..., as far as known.
  [[nodiscard]] double scale(Eigen::Index reading, Eigen::Index axis) const;

  [[nodiscard]] std::vector<std::string> names_of_axis(Eigen::Index axis) const;

  // Where a field is a sum its fields are those of its parts; else those of the levelnesses.
  [[nodiscard]] bool is_sum() const { return parts.size() > 1; }
  [[nodiscard]] Eigen::Vector3d field_in_table(Eigen::Index reading,
                                               const std::vector<Eigen::Vector3d>& fields) const;

  // Row [1, f, second fields] of a reading, by its rotation and the field in the table.
  [[nodiscard]] Eigen::RowVectorXd design_row(const Eigen::Matrix3d& rotation,
                                              const Eigen::Vector3d& field_in_table) const;

  // Whether some axis leaves readings out (weight 0).
  [[nodiscard]] bool leaves_out() const { return (weights.array() == 0.0).any(); }

  [[nodiscard]] Eigen::Index size() const { return response.rows(); }
  [[nodiscard]] Eigen::Index axis_count() const { return response.cols(); }

  /// Residuals of axis k below this are rounding.
  [[nodiscard]] double rounding(Eigen::Index k) const;

  /// The largest of them, where axes are looked at together.
  [[nodiscard]] double rounding() const;
};

/// ".d", ".d2", .. for a power 1, 2, ... of the temperature.
[[nodiscard]] std::string power_suffix(int power);

/// ".bias.d", ".bias.d2", .., ".scale.d", ..
[[nodiscard]] std::vector<std::string> temperature_suffixes(int order);

/// The names of the parameters of some axes, all columns.
[[nodiscard]] std::vector<std::string> parameter_names(
    const std::vector<std::string>& axes,
    const std::vector<std::string>& also_kinds = {},
    int temperature_order = 0);

/// From the covariance of a record's statistics: names of the parameters, standard errors, coverage
/// factors.
void add_intervals(Calibration& calibration);

/// The same for the columns that are open, for all axes.
[[nodiscard]] std::vector<std::string> names_of_columns(const std::vector<std::string>& axes,
                                                        const std::vector<Eigen::Index>& columns,
                                                        const std::vector<std::string>& also_kinds);

/// How a part of the field starts where its direction is fitted.
struct FieldStart {
  Eigen::Vector3d value = Eigen::Vector3d::UnitZ();  // its length is F
  bool has_direction = true;                         // else any: several starts
  // What decides between (S, f) and (-S, -f), which fit alike; else the sign expected of S.
  Eigen::Vector3d sign_by = Eigen::Vector3d::Zero();
};

/// An axis whose largest or smallest value comes several times, where other readings all differ.
struct SaturatedAxis {
  Eigen::Index axis = 0;
  double value = 0.0;
  std::vector<int> runs;
};

/// What each method gives.
struct Estimate {
  std::vector<SaturatedAxis> saturated;
  LinearResponse response;
  std::vector<SensitivityMatrix> also;  // one for each second field
  Eigen::MatrixXd temperature_bias;     // m x order, METHOD 6
  Eigen::MatrixXd temperature_scale;
  // In the table, one for each levelness (of a sum: for each part); empty: as readings.
  std::vector<Eigen::Vector3d> fields;
  FitStatistics statistics;
  std::optional<Levelness> levelness;
  std::optional<Eigen::Matrix3d> field_covariance;  // joint: of the fields' mean
  double field_degrees_of_freedom = 0.0;
  double mean_field = 0.0;            // known by fx,fy,fz: mean length of the fields given
  double direction_se_rad = 0.0;      // joint: the larger standard error of the field's direction
  std::vector<std::size_t> unpaired;  // paired: readings without their opposite, left out
  bool unsettled = false;             // one-sided axes: which readings they see does not settle
  std::vector<std::string> notes;     // remarks that ask for nothing
  std::string ambiguity;              // joint: two solutions that fit alike, in words
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
/// @param starts  one for each part.
[[nodiscard]] Estimate estimate_joint(const ReadingSet& set, const std::vector<FieldStart>& starts);

/// The field known for each reading (METHOD 4).
/// @param in_table  the field, of a sum its parts; empty where the readings bring theirs.
[[nodiscard]] Estimate estimate_known(const ReadingSet& set,
                                      const std::vector<Eigen::Vector3d>& in_table);

/// The set as it would have been read at the reference temperature.
[[nodiscard]] ReadingSet without_temperature(ReadingSet set, const Estimate& estimate);

/// Takes what the columns of an axis's regression say into the estimate.
void put_coefficients(const ReadingSet& set,
                      Eigen::Index axis,
                      const Eigen::VectorXd& coefficients,
                      Estimate& estimate);

/// Rows [1, f_i, second fields] of the regression for the fields in the table; n x
/// base_column_count().
[[nodiscard]] Eigen::MatrixXd field_design(const ReadingSet& set,
                                           const std::vector<Eigen::Vector3d>& fields);

}  // namespace axiscal
