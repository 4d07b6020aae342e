// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// A field that the experimenter makes: a turntable's rotation, a coil's field, a lamp's light.
///
/// It is constant in the table's frame, and the `level` of a reading multiplies it.
class AXISCAL_EXPORT InducedField final : public ReferenceField {
 public:
  /// @param kind            "induced_rotation", "induced_magnetic", "light" or a name of your own.
  /// @param value_in_table  value at level 1 [unit], frame table; not zero.
  /// @param unit            unit of the vector.
  /// @throws DomainError  if the vector is zero or not finite.
  InducedField(std::string kind, const Eigen::Vector3d& value_in_table, std::string unit);

  /// @return the vector in the table's frame. That frame is enu if the table is level and its y
  ///         axis points north.
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return value_; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return kind_; }
  [[nodiscard]] bool is_induced() const override { return true; }

  void state(FieldSetup& setup) const override;

 private:
  std::string kind_;
  Eigen::Vector3d value_;
  std::string unit_;
};

}  // namespace axiscal
