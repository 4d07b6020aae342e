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

/// A table of n readings and m axes: true if the axis uses the reading.
using AxisMask = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>;

/// The temperature terms of the axes during the fit (method.md, section 6). An axis with the
/// sensitivity S responds to a field f by g S f. The temperature scale is g = 1 + c_1 d + c_2 d^2 +
/// ... The product g S f is linearised in c and in S: the design columns for c_j are d^j (S f), and
/// those for S are g f. These columns are computed with the values of c and S of the previous step.
struct TemperatureTerms {
  int order = 0;
  Eigen::MatrixXd d;  // n x m: temperature of each axis minus its reference temperature
  // n: index of the soak level (plateau of constant temperature) at each reading; empty if the
  // temperature is continuous
  std::vector<int> soak;
  Eigen::MatrixXd scale;    // m x order: the present values of c
  SensitivityMatrix along;  // m x 3: the present values of S
};

/// The input of a fit: n readings of m axes, with the properties of the model.
struct ReadingSet {
  std::vector<Reading> readings;         // n
  Eigen::MatrixXd response;              // n x m
  Eigen::MatrixXd weights;               // n x m; the mean is 1 for each axis
  Rotations rotation_sensor_from_table;  // n; empty if each reading has its own given field
  std::function<Eigen::Matrix3d(const DesignPoint&)>
      orientation;  // rotation_sensor_from_table of any design point
  // n matrices: each maps the field at the mean time to the field at the time of the reading, both
  // in the table's frame. It is a rotation times the ratio of the magnitudes. Empty if the field is
  // constant.
  std::vector<Eigen::Matrix3d> field_then;
  std::vector<std::string> axes;  // m names
  // field component (0, 1 or 2) that each axis nominally senses; nullopt if unknown
  std::vector<std::optional<int>> nominal;
  TableField field;  // the parts of the field and the tilts of the table; has no vectors
  // Second fields (Experiment::also): further fields that affect the readings. They are known in
  // the table's frame and independent of the level. Each adds three columns.
  std::vector<std::string> also_kinds;
  std::vector<Eigen::Vector3d> also_in_table;
  Eigen::VectorXd noise_ratio;  // m: relative noise of the axes; empty if not stated
  bool robust = false;
  bool has_fence = true;                           // value of Observations::has_fence
  Eigen::Matrix3Xd seen = Eigen::Matrix3Xd(3, 0);  // see seen_directions(); usually empty
  // For one-sided axes and a field of several parts: one n x m table for each part, which is true
  // if the axis responds to the part at the reading. Empty if every axis responds to all parts.
  std::vector<AxisMask> visible;
  TemperatureTerms temperature;
  RunEffects effects;  // columns for the effects of the run; there may be none

  // Returns the index of the table's tilt at a reading, see TableField.
  [[nodiscard]] std::size_t tilt_of(std::size_t reading) const {
    return field.tilt_of_block(readings[reading].block);
  }

  [[nodiscard]] int soak_of(std::size_t reading) const {
    return temperature.soak.empty() ? 0 : temperature.soak[reading];
  }

  // Returns the number of columns in the regression of an axis. First come the columns of the
  // coefficients [1, f, second fields, d, .., d S f, ..], then those of the run's effects.
  [[nodiscard]] Eigen::Index column_count() const {
    return coefficient_count() + effects.columns.cols();
  }
  [[nodiscard]] Eigen::Index coefficient_count() const {
    return base_column_count() + 2 * temperature.order;
  }
  [[nodiscard]] Eigen::Index base_column_count() const {
    return 4 + 3 * static_cast<Eigen::Index>(also_in_table.size());
  }

  // Returns the indices of all axes' coefficients among all columns, axis by axis.
  [[nodiscard]] std::vector<Eigen::Index> coefficient_column_indices() const;

  // Appends the columns of the temperature terms and of the run's effects to the columns [1, f,
  // second fields] of an axis. The first function does this for all readings, the second for one
  // row.
  [[nodiscard]] Eigen::MatrixXd all_columns(const Eigen::MatrixXd& design, Eigen::Index axis) const;
  [[nodiscard]] Eigen::RowVectorXd all_columns(const Eigen::RowVectorXd& row,
                                               Eigen::Index reading,
                                               Eigen::Index axis) const;

  // Finds axes that can be fitted together because they have the same columns and weights. Columns
  // are the same for all axes if there are no temperature terms, no memory of the previous reading,
  // and no parts of the field that only some axes see.
  // @param of_axes  weights, n x m.
  // @return the end of the range of axes that starts at `first` and has the same columns and
  //         weights.
  [[nodiscard]] Eigen::Index end_of_alike(Eigen::Index first, const Eigen::MatrixXd& of_axes) const;

  // observable_columns() returns the columns of an axis whose coefficients its readings determine.
  // observable_column_map() returns the matrix that converts these coefficients to the coefficients
  // of all columns. A transfer (fields that differ in fewer than three directions) has one
  // sensitivity column for each of these directions. Otherwise all columns are observable.
  [[nodiscard]] Eigen::MatrixXd observable_columns(const Eigen::MatrixXd& design,
                                                   Eigen::Index axis) const;
  [[nodiscard]] Eigen::MatrixXd observable_column_map() const;

  // Returns the temperature scale 1 + c_1 d + c_2 d^2 + ... with the present values of c.
  [[nodiscard]] double scale(Eigen::Index reading, Eigen::Index axis) const;

  [[nodiscard]] std::vector<std::string> names_of_axis(Eigen::Index axis) const;

  // Returns the matrix that maps the field at the mean time, in the table's frame, to the field at
  // a reading, in the sensor's frame.
  [[nodiscard]] Eigen::Matrix3d met_of_field(std::size_t reading) const {
    return field_then.empty()
               ? rotation_sensor_from_table[reading]
               : Eigen::Matrix3d(rotation_sensor_from_table[reading] * field_then[reading]);
  }

  // field_in_table() returns the field at a reading in the table's frame, for the vectors in
  // `field_at`. field_change() returns its derivative with respect to vector number `which`.
  [[nodiscard]] Eigen::Vector3d field_in_table(Eigen::Index reading,
                                               const TableField& field_at) const;
  [[nodiscard]] Eigen::Matrix3d field_change(Eigen::Index reading,
                                             const TableField& field_at,
                                             std::size_t which) const;

  // sees() returns true if an axis responds to a part of the field at a reading. seen_in_table()
  // returns the sum of the parts to which the axis responds, in the table's frame.
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

  // Returns true if some readings have the weight 0 for some axis.
  [[nodiscard]] bool has_excluded_readings() const { return (weights.array() == 0.0).any(); }

  // Returns true if the fit does not change the set: there are no temperature terms, and all axes
  // use all readings and respond to all parts of the field.
  [[nodiscard]] bool is_final() const {
    return temperature.order == 0 && visible.empty() && !has_excluded_readings();
  }

  [[nodiscard]] Eigen::Index size() const { return response.rows(); }
  [[nodiscard]] Eigen::Index axis_count() const { return response.cols(); }

  // Returns the readings of axis k with a weight above 0.
  [[nodiscard]] std::vector<double> readings_of_axis(Eigen::Index k) const;

  /// Returns the rounding error of double precision for axis k [unit]. It is computed from the
  /// largest absolute reading that the axis uses. Residuals smaller than this contain no
  /// information.
  [[nodiscard]] double rounding(Eigen::Index k) const;

  /// The largest rounding(k) of all axes.
  [[nodiscard]] double rounding() const;
};

/// Returns the rows [1, f_i, second fields] of the regression, n x base_column_count(). f_i is the
/// field at reading i in the sensor's frame. If `field` has no vectors, f_i is the field that was
/// given for reading i.
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
  std::vector<Eigen::MatrixXd> designs_;  // one design for all axes, or one for each axis
};

}  // namespace axiscal
