// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/reading_set.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include "calib/fit/reading_step.hpp"
#include "calib/record/parameter_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {

double ReadingSet::rounding(Eigen::Index k) const {
  const double largest =
      (weights.col(k).array() > 0.0).select(response.col(k).array().abs(), 0.0).maxCoeff();
  return 64.0 * std::numeric_limits<double>::epsilon() * largest;
}

double ReadingSet::rounding() const {
  double largest = 0.0;
  for (Eigen::Index k = 0; k < axis_count(); ++k) {
    largest = std::max(largest, rounding(k));
  }
  return largest;
}

Eigen::Vector3d ReadingSet::field_in_table(Eigen::Index reading, const TableField& field_at) const {
  const auto i = static_cast<std::size_t>(reading);
  const Eigen::Vector3d at_mean_time = field_at.at(readings[i].level, tilt_of(i));
  return field_then.empty() ? at_mean_time : Eigen::Vector3d(field_then[i] * at_mean_time);
}

Eigen::Matrix3d ReadingSet::field_change(Eigen::Index reading,
                                         const TableField& field_at,
                                         std::size_t which) const {
  const auto i = static_cast<std::size_t>(reading);
  const Eigen::Matrix3d change = field_at.change(readings[i].level, tilt_of(i), which);
  return field_then.empty() ? change : Eigen::Matrix3d(field_then[i] * change);
}

Eigen::Vector3d ReadingSet::seen_in_table(Eigen::Index axis,
                                          Eigen::Index reading,
                                          const TableField& field_at) const {
  if (visible.empty()) {
    return field_in_table(reading, field_at);
  }
  const FieldLevel& level = readings[static_cast<std::size_t>(reading)].level;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t p = 0; p < visible.size(); ++p) {
    if (sees(axis, reading, p)) {
      sum += field_at.factor_of(p, level) * field_at.vector(p);
    }
  }
  return sum;
}

Eigen::RowVectorXd ReadingSet::design_row(const Eigen::Matrix3d& rotation,
                                          const Eigen::Vector3d& field_in_table) const {
  Eigen::RowVectorXd row(base_column_count());
  row(0) = 1.0;
  row.segment<3>(1) = rotation * field_in_table;
  for (std::size_t a = 0; a < also_in_table.size(); ++a) {
    row.segment<3>(4 + 3 * static_cast<Eigen::Index>(a)) = rotation * also_in_table[a];
  }
  return row;
}

double ReadingSet::scale(Eigen::Index reading, Eigen::Index axis) const {
  double factor = 1.0;
  double power = 1.0;
  for (int j = 0; j < temperature.order; ++j) {
    power *= temperature.d(reading, axis);
    factor += temperature.scale(axis, j) * power;
  }
  return factor;
}

std::vector<Eigen::Index> ReadingSet::coefficient_column_indices() const {
  std::vector<Eigen::Index> places;
  for (Eigen::Index k = 0; k < axis_count(); ++k) {
    for (Eigen::Index j = 0; j < coefficient_count(); ++j) {
      places.push_back(column_count() * k + j);
    }
  }
  return places;
}

Eigen::RowVectorXd ReadingSet::all_columns(const Eigen::RowVectorXd& row,
                                           Eigen::Index reading,
                                           Eigen::Index axis) const {
  Eigen::RowVectorXd full(column_count());
  full.head(row.size()) = row;
  if (temperature.order > 0) {
    full.segment<3>(1) *= scale(reading, axis);
    const double sensed = temperature.along.row(axis).dot(row.segment<3>(1));
    double power = 1.0;
    for (int j = 0; j < temperature.order; ++j) {
      power *= temperature.d(reading, axis);
      full(row.size() + j) = power;
      full(row.size() + temperature.order + j) = power * sensed;
    }
  }
  if (effects.columns.cols() > 0) {
    full.tail(effects.columns.cols()) = effects.row(reading, axis);
  }
  return full;
}

Eigen::MatrixXd ReadingSet::all_columns(const Eigen::MatrixXd& design, Eigen::Index axis) const {
  if (column_count() == design.cols()) {
    return design;
  }
  Eigen::MatrixXd full(design.rows(), column_count());
  for (Eigen::Index i = 0; i < design.rows(); ++i) {
    full.row(i) = all_columns(Eigen::RowVectorXd(design.row(i)), i, axis);
  }
  return full;
}

std::vector<std::string> ReadingSet::names_of_axis(Eigen::Index axis) const {
  const std::string& name = axes[static_cast<std::size_t>(axis)];
  std::vector<std::string> names = parameter_names({name}, also_kinds, temperature.order);
  for (const std::string& effect : effects.names) {
    names.push_back(formatted("{}.{}", name, effect));
  }
  return names;
}

Eigen::Index ReadingSet::end_of_alike(Eigen::Index first, const Eigen::MatrixXd& of_axes) const {
  Eigen::Index end = first + 1;
  while (end < axis_count() && temperature.order == 0 && visible.empty() &&
         effects.memory.size() == 0 && of_axes.col(end) == of_axes.col(first)) {
    ++end;
  }
  return end;
}

Eigen::MatrixXd ReadingSet::observable_columns(const Eigen::MatrixXd& design,
                                               Eigen::Index axis) const {
  return seen.cols() == 0 ? all_columns(design, axis)
                          : all_columns(design, axis) * observable_column_map();
}

Eigen::MatrixXd ReadingSet::observable_column_map() const {
  const Eigen::Index all = column_count();
  if (seen.cols() == 0) {
    return Eigen::MatrixXd::Identity(all, all);
  }
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(all, all - 3 + seen.cols());
  map(0, 0) = 1.0;
  map.block(1, 1, 3, seen.cols()) = seen;
  map.bottomRightCorner(all - 4, all - 4).setIdentity();
  return map;
}

std::vector<double> ReadingSet::readings_of_axis(Eigen::Index k) const {
  return readings_with_weight(response.col(k), weights.col(k));
}

Eigen::MatrixXd field_design(const ReadingSet& set, const TableField& field) {
  Eigen::MatrixXd design(set.size(), set.base_column_count());
  design.col(0).setOnes();
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (!field.has_vectors()) {
      design.row(i).tail<3>() = *set.readings[at].field_in_sensor;
      continue;
    }
    const Eigen::Matrix3d& rotation = set.rotation_sensor_from_table[at];
    design.row(i).segment<3>(1) = rotation * set.field_in_table(i, field);
    for (std::size_t a = 0; a < set.also_in_table.size(); ++a) {
      design.row(i).segment<3>(4 + 3 * static_cast<Eigen::Index>(a)) =
          rotation * set.also_in_table[a];
    }
  }
  return design;
}

AxisDesigns::AxisDesigns(const ReadingSet& set, const TableField& field) {
  designs_.push_back(field_design(set, field));
  if (set.visible.empty()) {
    return;
  }
  designs_.resize(static_cast<std::size_t>(set.axis_count()), designs_.front());
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      designs_[static_cast<std::size_t>(k)].row(i).segment<3>(1) =
          set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
          set.seen_in_table(k, i, field);
    }
  }
}

}  // namespace axiscal
