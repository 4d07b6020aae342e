// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/table_field.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {

TableField::TableField(std::vector<FieldPartDescription> parts) : parts_(std::move(parts)) {
  if (parts_.empty()) {
    throw DomainError("a field in the table has at least one part");
  }
  level_can_be_set_ =
      std::any_of(parts_.begin(), parts_.end(),
                  [](const FieldPartDescription& part) { return part.set_by_level; });
  if (!is_sum()) {
    parts_.front().set_by_level = true;
  }
}

bool TableField::turns() const {
  return std::any_of(parts_.begin(), parts_.end(),
                     [](const FieldPartDescription& part) { return part.turning; });
}

std::size_t TableField::tilt_of_block(int block) const {
  const auto found = std::lower_bound(blocks_.begin(), blocks_.end(), block);
  const bool has_own = found != blocks_.end() && *found == block;
  return has_own ? static_cast<std::size_t>(found - blocks_.begin()) : 0;
}

std::string TableField::name_of(std::size_t which) const {
  if (is_sum()) {
    const FieldPartDescription& part = parts_[which];
    const bool alone = std::count_if(parts_.begin(), parts_.end(), [&](const auto& other) {
                         return other.kind == part.kind;
                       }) == 1;
    const std::string_view role = alone ? "" : part.set_by_level ? "induced " : "local ";
    return formatted("the {}field {}", role, part.kind);
  }
  return blocks_.size() > 1 ? formatted("the field in block {}", blocks_[which]) : "the field";
}

std::size_t TableField::turning_part(double level) const {
  const auto turns = [&](const FieldPartDescription& part) { return part.turning && level != 0.0; };
  return static_cast<std::size_t>(std::find_if(parts_.begin(), parts_.end(), turns) -
                                  parts_.begin());
}

Eigen::Vector3d TableField::at(const Vectors& vectors, double level, std::size_t tilt) const {
  if (!is_sum()) {
    return level * vectors[tilt];
  }
  const std::size_t turning = turning_part(level);
  const Eigen::Vector3d axis = turning < parts_.size()
                                   ? Eigen::Vector3d(vectors[turning].normalized())
                                   : Eigen::Vector3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Eigen::Vector3d value = factor_of(p, level) * vectors[p];
    const bool averages = turning < parts_.size() && !parts_[p].turning;
    sum += averages ? Eigen::Vector3d(value.dot(axis) * axis) : value;
  }
  return sum;
}

Eigen::Matrix3d TableField::change(const Vectors& vectors,
                                   double level,
                                   std::size_t tilt,
                                   std::size_t which) const {
  if (!is_sum()) {
    return (which == tilt ? level : 0.0) * Eigen::Matrix3d::Identity();
  }
  const std::size_t turning = turning_part(level);
  const double factor = factor_of(which, level);
  if (turning == parts_.size()) {
    return factor * Eigen::Matrix3d::Identity();
  }
  // Of the parts that do not turn with the table (L . a) a is left, a the axis.
  const Eigen::Vector3d axis = vectors[turning].normalized();
  const Eigen::Matrix3d along = axis * axis.transpose();
  if (which != turning) {
    return factor * along;
  }
  Eigen::Matrix3d change = factor * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d turns = (Eigen::Matrix3d::Identity() - along) / vectors[turning].norm();
  for (std::size_t p = 0; p < vectors.size(); ++p) {
    if (p != turning) {
      const Eigen::Vector3d other = factor_of(p, level) * vectors[p];
      change += (axis * other.transpose() + other.dot(axis) * Eigen::Matrix3d::Identity()) * turns;
    }
  }
  return change;
}

Eigen::Matrix3d TableField::change_of_mean(const Vectors& vectors, std::size_t which) const {
  if (is_sum()) {
    return change(vectors, 1.0, 0, which);
  }
  return 1.0 / static_cast<double>(vectors.size()) * Eigen::Matrix3d::Identity();
}

TableField::Tangents TableField::tangents(const Vectors& vectors, std::size_t which) const {
  const bool free_length = is_sum() && parts_[which].free_length;
  Tangents own(3, free_length ? 3 : 2);
  own.leftCols<2>() = tangents_of(vectors[which]);
  if (free_length) {
    own.col(2) = vectors[which].normalized();
  }
  return own;
}

Eigen::Vector3d TableField::moved(const Eigen::Vector3d& vector,
                                  const Tangents& tangents,
                                  const Eigen::VectorXd& step) {
  const double F = vector.norm() * (step.size() > 2 ? std::exp(step(2)) : 1.0);
  return F * (vector.normalized() + tangents.leftCols<2>() * step.head<2>()).normalized();
}

}  // namespace axiscal
