// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_description.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/field/table_field.hpp"

namespace axiscal {

std::vector<FieldDescription> FieldDescription::as_parts() const {
  return parts.empty() ? std::vector<FieldDescription>{*this} : parts;
}

Eigen::Vector3d FieldDescription::at_level(double level) const {
  if (parts.empty()) {
    return level * in_table.value_or(Eigen::Vector3d(0.0, 0.0, magnitude));
  }
  std::vector<Eigen::Vector3d> values;
  for (const FieldDescription& part : parts) {
    values.push_back(part.in_table.value_or(Eigen::Vector3d::Zero()));
  }
  return TableField(parts).with(std::move(values)).at(level);
}

FieldDescription sum_of(std::vector<FieldDescription> parts) {
  if (parts.size() == 1) {
    return std::move(parts.front());
  }
  FieldDescription field;
  field.unit = parts.front().unit;
  field.local_gravity = parts.front().local_gravity;
  field.local_gravity_u = parts.front().local_gravity_u;
  field.magnitude = parts.front().magnitude;
  const bool has_value = std::all_of(parts.begin(), parts.end(), [](const FieldDescription& part) {
    return part.in_table && !part.free_length;
  });
  for (const FieldDescription& part : parts) {
    field.kind += (field.kind.empty() ? "" : "+") + part.kind;
    field.model = field.model.empty() ? part.model : field.model;
    field.magnitude_u = std::hypot(field.magnitude_u, part.magnitude_u);
  }
  field.parts = std::move(parts);
  if (has_value) {
    field.in_table = field.at_level(1.0);
    field.magnitude = field.in_table->norm();
  }
  return field;
}

}  // namespace axiscal
