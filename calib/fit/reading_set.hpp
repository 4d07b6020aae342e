// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/field/table_field.hpp"
#include "calib/fit/rotations.hpp"
#include "calib/fit/run_effects.hpp"

namespace axiscal {

/// n x m: which readings an axis uses.
using AxisMask = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>;

/// The temperature terms of the axes during the fit (method.md, section 6). The temperature scale
/// is 1 + c_1 d + c_2 d^2 + ...; it multiplies S f. This product is linearised in both factors: the
/// columns are d^j (S f) and scale f, with the values of c and S from the previous step.
struct TemperatureTerms {
  int order = 0;
  Eigen::MatrixXd d;        // n x m: t - reference, from the temperature sensor of each axis
  std::vector<int> soak;    // n: number of the soak level; empty if temperatures are continuous
  Eigen::MatrixXd scale;    // m x order: the present values of c
  SensitivityMatrix along;  // m x 3: the present S, which c multiplies
};

/// The input of a fit: n readings of m axes, with the properties of the model.
struct ReadingSet {
  std::vector<Reading> readings;         // n
  Eigen::MatrixXd response;              // n x m
  Eigen::MatrixXd weights;               // n x m; the mean is 1 for each axis
  Rotations rotation_sensor_from_table;  // n; empty if the readings state their fields
  std::function<Eigen::Matrix3d(const DesignPoint&)>
      orientation;  // rotation_sensor_from_table of any design point
  // n: the map from the field at the mean time to the field at the reading, in the table: a
  // rotation times the ratio of the lengths. Empty if the field is constant.
  std::vector<Eigen::Matrix3d> field_then;
  std::vector<std::string> axes;            // m names
  std::vector<std::optional<int>> nominal;  // the nominal component of each axis; or empty
  TableField field;                         // parts and tilts of the field; without vectors
  // Second fields: known in the table and independent of the level. Each adds three columns.
  std::vector<std::string> also_kinds;
  std::vector<Eigen::Vector3d> also_in_table;
  Eigen::VectorXd noise_ratio;  // m: stated ratio of the axes' noise; empty if unknown
  bool robust = false;
  bool has_fence = true;                           // value of Observations::has_fence
  Eigen::Matrix3Xd seen = Eigen::Matrix3Xd(3, 0);  // for a transfer: result of seen_directions()
  // For one-sided axes under several lights: whether an axis sees a part of the field at a reading,
  // n x m for each part. Empty if every axis sees all parts.
  std::vector<AxisMask> visible;
  TemperatureTerms temperature;
  RunEffects effects;  // effects of the run; effects.columns may have 0 columns

  // The index of the field's tilt at a reading.
  [[nodiscard]] std::size_t tilt_of(std::size_t reading) const {
    return field.tilt_of_block(readings[reading].block);
  }

  [[nodiscard]] int soak_of(std::size_t reading) const {
    return temperature.soak.empty() ? 0 : temperature.soak[reading];
  }

  // Returns the number of columns of an axis's regression: the columns of the coefficients [1, f,
  // second fields, d, .., d S f, ..], then those of the run's effects.
  [[nodiscard]] Eigen::Index column_count() const {
    return coefficient_count() + effects.columns.cols();
  }
  [[nodiscard]] Eigen::Index coefficient_count() const {
    return base_column_count() + 2 * temperature.order;
  }
  [[nodiscard]] Eigen::Index base_column_count() const {
    return 4 + 3 * static_cast<Eigen::Index>(also_in_table.size());
  }

  // The indices of the coefficients of all axes among all columns, axis by axis.
  [[nodiscard]] std::vector<Eigen::Index> coefficient_column_indices() const;

  // Extends the columns [1, f, second fields] of an axis by those of the temperature terms and of
  // the run's effects: for all readings, and for one row.
  [[nodiscard]] Eigen::MatrixXd all_columns(const Eigen::MatrixXd& design, Eigen::Index axis) const;
  [[nodiscard]] Eigen::RowVectorXd all_columns(const Eigen::RowVectorXd& row,
                                               Eigen::Index reading,
                                               Eigen::Index axis) const;

  // Axes have the same columns if there are no temperature terms, no memory, and no parts of the
  // field that only some axes see.
  // @param of_axes  weights, n x m.
  // @return the end of the range of axes that starts at `first` and has the same columns and
  //         weights.
  [[nodiscard]] Eigen::Index end_of_alike(Eigen::Index first, const Eigen::MatrixXd& of_axes) const;

  // observable_columns() returns the columns of an axis whose coefficients its readings determine.
  // observable_column_map() returns the matrix that converts these coefficients to all
  // coefficients. A transfer has one sensitivity column for each direction in which its fields
  // differ; otherwise these are all columns.
  [[nodiscard]] Eigen::MatrixXd observable_columns(const Eigen::MatrixXd& design,
                                                   Eigen::Index axis) const;
  [[nodiscard]] Eigen::MatrixXd observable_column_map() const;

  // The temperature scale 1 + c_1 d + c_2 d^2 + ... with the present values of c.
  [[nodiscard]] double scale(Eigen::Index reading, Eigen::Index axis) const;

  [[nodiscard]] std::vector<std::string> names_of_axis(Eigen::Index axis) const;

  // The map from a field in the table, at the mean time, to the field at a reading, in the sensor's
  // frame.
  [[nodiscard]] Eigen::Matrix3d met_of_field(std::size_t reading) const {
    return field_then.empty()
               ? rotation_sensor_from_table[reading]
               : Eigen::Matrix3d(rotation_sensor_from_table[reading] * field_then[reading]);
  }

  // The field at a reading in the table's frame for the given vectors, and its derivative with
  // respect to a vector.
  [[nodiscard]] Eigen::Vector3d field_in_table(Eigen::Index reading,
                                               const TableField& field_at) const;
  [[nodiscard]] Eigen::Matrix3d field_change(Eigen::Index reading,
                                             const TableField& field_at,
                                             std::size_t which) const;

  // sees() is true if an axis responds to a part of the field at a reading. seen_in_table() is the
  // sum of the parts to which the axis responds, in the table's frame.
  [[nodiscard]] bool sees(Eigen::Index axis, Eigen::Index reading, std::size_t part) const {
    return visible.empty() || visible[part](reading, axis);
  }
  [[nodiscard]] Eigen::Vector3d seen_in_table(Eigen::Index axis,
                                              Eigen::Index reading,
                                              const TableField& field_at) const;

  // Returns the row [1, f, second fields] of a reading with the given rotation and field in the
  // table.
  [[nodiscard]] Eigen::RowVectorXd design_row(const Eigen::Matrix3d& rotation,
                                              const Eigen::Vector3d& field_in_table) const;

  // True if an axis has readings of weight 0.
  [[nodiscard]] bool has_excluded_readings() const { return (weights.array() == 0.0).any(); }

  // True if the fit does not change the set. This is so if there are no temperature terms, and all
  // axes use all readings and see all lights.
  [[nodiscard]] bool is_final() const {
    return temperature.order == 0 && visible.empty() && !has_excluded_readings();
  }

  [[nodiscard]] Eigen::Index size() const { return response.rows(); }
  [[nodiscard]] Eigen::Index axis_count() const { return response.cols(); }

  // The readings of axis k with weight above 0.
  [[nodiscard]] std::vector<double> readings_of_axis(Eigen::Index k) const;

  /// Returns the rounding error of double precision for axis k [unit]. It is computed from the
  /// largest absolute reading that the axis uses. Residuals smaller than this contain no
  /// information.
  [[nodiscard]] double rounding(Eigen::Index k) const;

  /// The largest rounding(k) of all axes.
  [[nodiscard]] double rounding() const;
};

/// Rows [1, f_i, second fields] of the regression; n x base_column_count(). If `field` has no
/// vectors, f_i is the field that reading i states.
[[nodiscard]] Eigen::MatrixXd field_design(const ReadingSet& set, const TableField& field);

/// The design of each axis: field_design() for all axes, unless axes see different parts of the
/// field.
class AxisDesigns {
 public:
  AxisDesigns(const ReadingSet& set, const TableField& field);

  [[nodiscard]] const Eigen::MatrixXd& of(Eigen::Index axis) const {
    return designs_[designs_.size() == 1 ? 0 : static_cast<std::size_t>(axis)];
  }

 private:
  std::vector<Eigen::MatrixXd> designs_;  // one for all, or one for each axis
};

}  // namespace axiscal
