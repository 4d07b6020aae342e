// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/table_field.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "core/formatted.hpp"

namespace axiscal {

TableField::TableField() {
  // All default-constructed fields share one layout, to save memory.
  static const std::shared_ptr<const Layout> one =
      TableField(std::vector<FieldDescription>(1)).layout_;
  layout_ = one;
}

TableField::TableField(std::vector<FieldDescription> parts) {
  if (parts.empty()) {
    throw DomainError("a field in the table's frame must have at least one part");
  }
  Layout layout;
  layout.level_can_be_set = std::any_of(
      parts.begin(), parts.end(), [](const FieldDescription& part) { return part.set_by_level; });
  if (parts.size() == 1) {
    parts.front().set_by_level = true;
  }
  layout.parts = std::move(parts);
  layout_ = std::make_shared<const Layout>(std::move(layout));
}

TableField TableField::tilted_by_block(std::vector<int> blocks) const {
  TableField field;
  Layout layout = *layout_;
  layout.blocks = std::move(blocks);
  field.layout_ = std::make_shared<const Layout>(std::move(layout));
  return field;
}

TableField TableField::with(std::vector<Eigen::Vector3d> vectors) const {
  if (vectors.size() != vector_count()) {
    throw DomainError(formatted("a field in the table's frame needs {} vectors, not {}",
                                vector_count(), vectors.size()));
  }
  TableField field = without_vectors();
  field.vectors_ = std::move(vectors);
  return field;
}

TableField TableField::with_all(const Eigen::Vector3d& vector) const {
  return with(std::vector<Eigen::Vector3d>(vector_count(), vector));
}

TableField TableField::as_stated() const {
  double longest = 0.0;
  for (const FieldDescription& part : parts()) {
    longest = part.free_length ? longest : std::max(longest, part.magnitude);
  }
  std::vector<Eigen::Vector3d> vectors;
  for (const FieldDescription& part : parts()) {
    const Eigen::Vector3d towards = part.in_table.value_or(Eigen::Vector3d::UnitZ());
    vectors.emplace_back(part.free_length ? Eigen::Vector3d(longest * towards.normalized())
                         : part.in_table  ? towards
                                          : Eigen::Vector3d(part.magnitude * towards));
  }
  return is_sum() ? with(std::move(vectors)) : with_all(vectors.front());
}

TableField TableField::without_vectors() const {
  TableField field = *this;
  field.vectors_.clear();
  return field;
}

bool TableField::turns() const {
  return std::any_of(parts().begin(), parts().end(),
                     [](const FieldDescription& part) { return part.turning; });
}

std::size_t TableField::tilt_of_block(int block) const {
  const std::vector<int>& all = blocks();
  const auto found = std::lower_bound(all.begin(), all.end(), block);
  const bool has_own = found != all.end() && *found == block;
  return has_own ? static_cast<std::size_t>(found - all.begin()) : 0;
}

Eigen::Vector3d TableField::mean() const {
  if (is_sum()) {
    return at(1.0);
  }
  if (vectors_.size() == 1) {
    return vectors_.front();
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vector : vectors_) {
    sum += vector;
  }
  return magnitude() * sum.normalized();
}

std::string TableField::name_of(std::size_t which) const {
  if (is_sum()) {
    const FieldDescription& part = parts()[which];
    const auto alike = [&](const auto& same) {
      return std::count_if(parts().begin(), parts().end(), same) > 1;
    };
    const bool has_twin = alike([&](const auto& other) { return other.kind == part.kind; });
    const bool by_name = !part.name.empty() && has_twin;
    const std::string_view role = !has_twin || by_name ? ""
                                  : part.set_by_level  ? "induced "
                                                       : "local ";
    return formatted("the {}field {}", role, by_name ? part.name : part.kind);
  }
  return blocks().size() > 1 ? formatted("the field in block {}", blocks()[which]) : "the field";
}

bool TableField::is_dark(const FieldLevel& level) const {
  for (std::size_t p = 0; p < parts().size(); ++p) {
    if (factor_of(p, level) != 0.0) {
      return false;
    }
  }
  return true;
}

std::size_t TableField::turning_part(const FieldLevel& level) const {
  std::size_t part = 0;
  while (part < parts().size() &&
         !(parts()[part].turning && level.of(parts()[part].level_name()) != 0.0)) {
    ++part;
  }
  return part;
}

Eigen::Vector3d TableField::at(const FieldLevel& level, std::size_t tilt) const {
  if (!is_sum()) {
    return level.of(parts().front().level_name()) * vectors_[tilt];
  }
  const std::size_t turning = turning_part(level);
  const Eigen::Vector3d axis = turning < parts().size()
                                   ? Eigen::Vector3d(vectors_[turning].normalized())
                                   : Eigen::Vector3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t p = 0; p < parts().size(); ++p) {
    const Eigen::Vector3d value = factor_of(p, level) * vectors_[p];
    const bool averages = turning < parts().size() && !parts()[p].turning;
    sum += averages ? Eigen::Vector3d(value.dot(axis) * axis) : value;
  }
  return sum;
}

Eigen::Matrix3d TableField::change(const FieldLevel& level,
                                   std::size_t tilt,
                                   std::size_t which) const {
  if (!is_sum()) {
    return (which == tilt ? level.of(parts().front().level_name()) : 0.0) *
           Eigen::Matrix3d::Identity();
  }
  const std::size_t turning = turning_part(level);
  const double factor = factor_of(which, level);
  if (turning == parts().size()) {
    return factor * Eigen::Matrix3d::Identity();
  }
  // The table turns about the unit vector a. Any other part L contributes (L . a) a to the sum.
  const Eigen::Vector3d axis = vectors_[turning].normalized();
  const Eigen::Matrix3d along = axis * axis.transpose();
  if (which != turning) {
    return factor * along;
  }
  Eigen::Matrix3d change = factor * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d turns = (Eigen::Matrix3d::Identity() - along) / vectors_[turning].norm();
  for (std::size_t p = 0; p < vectors_.size(); ++p) {
    if (p != turning) {
      const Eigen::Vector3d other = factor_of(p, level) * vectors_[p];
      change += (axis * other.transpose() + other.dot(axis) * Eigen::Matrix3d::Identity()) * turns;
    }
  }
  return change;
}

Eigen::Matrix3d TableField::change_of_mean(std::size_t which) const {
  if (is_sum()) {
    return change(1.0, 0, which);
  }
  return 1.0 / static_cast<double>(vectors_.size()) * Eigen::Matrix3d::Identity();
}

std::vector<TableField::Tangents> TableField::tangents() const {
  std::vector<Tangents> all;
  for (std::size_t v = 0; v < vectors_.size(); ++v) {
    if (has_free_length(v)) {
      all.emplace_back(Eigen::Matrix3d::Identity());
    } else {
      all.emplace_back(tangents_of(vectors_[v]));
    }
  }
  return all;
}

double TableField::step_unit(std::size_t which) const {
  if (!has_free_length(which)) {
    return vectors_[which].norm();
  }
  double longest = 0.0;
  for (std::size_t v = 0; v < vectors_.size(); ++v) {
    longest = has_free_length(v) ? longest : std::max(longest, vectors_[v].norm());
  }
  return longest;
}

TableField TableField::moved(const std::vector<Tangents>& tangents,
                             const Eigen::VectorXd& step) const {
  TableField field = *this;
  Eigen::Index first = 0;
  for (std::size_t v = 0; v < vectors_.size(); ++v) {
    const Eigen::VectorXd own = step.segment(first, tangents[v].cols());
    first += own.size();
    const double unit = step_unit(v);
    field.vectors_[v] =
        has_free_length(v)
            ? Eigen::Vector3d(vectors_[v] + unit * (tangents[v] * own))
            : Eigen::Vector3d(unit * (vectors_[v].normalized() + tangents[v] * own).normalized());
  }
  return field;
}

TableField TableField::reversed() const {
  TableField field = *this;
  for (Eigen::Vector3d& vector : field.vectors_) {
    vector *= -1.0;
  }
  return field;
}

}  // namespace axiscal
