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

/// The temperature terms of the axes during the fit (method.md, section 6). The product of scale
/// and field is linearised in both factors: the columns are d^j (S f) and scale(t) f.
struct TemperatureTerms {
  int order = 0;
  Eigen::MatrixXd d;        // n x m: t - reference, of the sensor that counts for an axis
  std::vector<int> soak;    // n: number of the soak level; empty where temperatures are continuous
  Eigen::MatrixXd scale;    // m x order: the present values of c
  SensitivityMatrix along;  // m x 3: S as far as known; at first the main axis alone [P]
};

/// The readings that a fit uses, in the instrument's terms: n readings, m axes.
struct ReadingSet {
  std::vector<Reading> readings;         // n
  Eigen::MatrixXd response;              // n x m
  Eigen::MatrixXd weights;               // n x m, of mean 1 per axis
  Rotations rotation_sensor_from_table;  // n; empty where readings bring fields
  std::function<Eigen::Matrix3d(const DesignPoint&)>
      orientation;  // rotation_sensor_from_table of any design point
  // n: the motion of the field in the table since the mean time, a turn times the ratio of its
  // lengths; empty if the field is constant.
  std::vector<Eigen::Matrix3d> field_then;
  std::vector<std::string> axes;            // m names
  std::vector<std::optional<int>> nominal;  // the component each axis is meant to sense; or empty
  TableField field;                         // its parts and tilts; without vectors
  // Second fields, known in the table, which no level changes: three more columns each.
  std::vector<std::string> also_kinds;
  std::vector<Eigen::Vector3d> also_in_table;
  Eigen::VectorXd noise_ratio;  // m: stated; empty where it is not known
  bool robust = false;
  bool has_fence = true;                           // as Observations::has_fence
  Eigen::Matrix3Xd seen = Eigen::Matrix3Xd(3, 0);  // of a transfer, as seen_directions()
  // Of one-sided axes under several lights: which of the parts each axis sees at each reading, n x
  // m for each part; empty where what one sees all see.
  std::vector<AxisMask> visible;
  TemperatureTerms temperature;
  RunEffects
      effects;  // of the run, in addition to the coefficients; the matrix may have zero columns

  // Which of the field's tilts a reading was taken at.
  [[nodiscard]] std::size_t tilt_of(std::size_t reading) const {
    return field.tilt_of_block(readings[reading].block);
  }

  [[nodiscard]] int soak_of(std::size_t reading) const {
    return temperature.soak.empty() ? 0 : temperature.soak[reading];
  }

  // The columns of the regression of an axis: the coefficients' [1, f, second fields, d, .., d S f,
  // ..], then those of the run's effects.
  [[nodiscard]] Eigen::Index column_count() const {
    return coefficient_count() + effects.columns.cols();
  }
  [[nodiscard]] Eigen::Index coefficient_count() const {
    return base_column_count() + 2 * temperature.order;
  }
  [[nodiscard]] Eigen::Index base_column_count() const {
    return 4 + 3 * static_cast<Eigen::Index>(also_in_table.size());
  }

  // Where the coefficients of all axes stand among all their columns, one axis after another.
  [[nodiscard]] std::vector<Eigen::Index> coefficient_column_indices() const;

  // Columns [1, f, second fields] of an axis with those of temperature and of the run; all
  // readings, and one row.
  [[nodiscard]] Eigen::MatrixXd all_columns(const Eigen::MatrixXd& design, Eigen::Index axis) const;
  [[nodiscard]] Eigen::RowVectorXd all_columns(const Eigen::RowVectorXd& row,
                                               Eigen::Index reading,
                                               Eigen::Index axis) const;

  // Axes have the same columns where neither temperature nor what they see tells them apart.
  // @param of_axes  weights, n x m.
  // @return the axis after those that follow `first` with the columns and the weights that it has.
  [[nodiscard]] Eigen::Index end_of_alike(Eigen::Index first, const Eigen::MatrixXd& of_axes) const;

  // The columns of an axis that its readings can separate, and the map to them from all columns.
  // These are all columns, except for a transfer, which has one for each direction of its fields.
  [[nodiscard]] Eigen::MatrixXd observable_columns(const Eigen::MatrixXd& design,
                                                   Eigen::Index axis) const;
  [[nodiscard]] Eigen::MatrixXd observable_column_map() const;

  // 1 + c_1 d + ..., as far as known.
  [[nodiscard]] double scale(Eigen::Index reading, Eigen::Index axis) const;

  [[nodiscard]] std::vector<std::string> names_of_axis(Eigen::Index axis) const;

  // The map from a field in the table, at the mean time, to the field at a reading, in the sensor's
  // frame.
  [[nodiscard]] Eigen::Matrix3d met_of_field(std::size_t reading) const {
    return field_then.empty()
               ? rotation_sensor_from_table[reading]
               : Eigen::Matrix3d(rotation_sensor_from_table[reading] * field_then[reading]);
  }

  // The field at a reading for the given vectors, and its derivative with respect to a vector.
  [[nodiscard]] Eigen::Vector3d field_in_table(Eigen::Index reading,
                                               const TableField& field_at) const;
  [[nodiscard]] Eigen::Matrix3d field_change(Eigen::Index reading,
                                             const TableField& field_at,
                                             std::size_t which) const;

  // The field seen by an axis, and its derivative.
  [[nodiscard]] bool sees(Eigen::Index axis, Eigen::Index reading, std::size_t part) const {
    return visible.empty() || visible[part](reading, axis);
  }
  [[nodiscard]] Eigen::Vector3d seen_in_table(Eigen::Index axis,
                                              Eigen::Index reading,
                                              const TableField& field_at) const;

  // Row [1, f, second fields] of a reading, by its rotation and the field in the table.
  [[nodiscard]] Eigen::RowVectorXd design_row(const Eigen::Matrix3d& rotation,
                                              const Eigen::Vector3d& field_in_table) const;

  // Whether some axis leaves readings out (weight 0).
  [[nodiscard]] bool has_excluded_readings() const { return (weights.array() == 0.0).any(); }

  // True if the set stays as it is after the fit: it lacks temperature terms, and its axes use all
  // readings and see all lights.
  [[nodiscard]] bool is_final() const {
    return temperature.order == 0 && visible.empty() && !has_excluded_readings();
  }

  [[nodiscard]] Eigen::Index size() const { return response.rows(); }
  [[nodiscard]] Eigen::Index axis_count() const { return response.cols(); }

  // The readings of axis k that have weight.
  [[nodiscard]] std::vector<double> readings_of_axis(Eigen::Index k) const;

  /// Residuals of axis k below this are rounding; by the readings that it uses.
  [[nodiscard]] double rounding(Eigen::Index k) const;

  /// The largest of the axes' limits, if axes are judged together.
  [[nodiscard]] double rounding() const;
};

/// Rows [1, f_i, second fields] of the regression for the fields in the table, or where there are
/// none for those that the readings bring; n x base_column_count().
[[nodiscard]] Eigen::MatrixXd field_design(const ReadingSet& set, const TableField& field);

/// The rows of each axis: field_design() for all, unless axes see different parts of the field.
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
