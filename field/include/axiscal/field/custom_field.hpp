// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// A constant field that is given as a vector, for example a measured field or the field of a lamp.
class AXISCAL_EXPORT CustomField final : public ReferenceField {
 public:
  /// A field whose magnitude or vector the experiment states. If it states neither and the unit is
  /// "1", the magnitude is 1.
  CustomField() = default;

  /// @param value_in_enu  the field [unit], frame enu; not zero.
  /// @param unit          any text; "1" for a field in relative units.
  /// @throws DomainError  if the vector is zero or not finite.
  explicit CustomField(const Eigen::Vector3d& value_in_enu, std::string unit = "1");

  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return value_in_enu_; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "custom"; }
  [[nodiscard]] bool is_induced() const override { return !has_value(); }

  void state(FieldSetup& setup) const override;
  void resolve(FieldResolver& of) const override;
  void members(JsonMembers& io) override;

 private:
  [[nodiscard]] bool has_value() const { return value_in_enu_.norm() > 0.0; }

  Eigen::Vector3d value_in_enu_ = Eigen::Vector3d::Zero();
  std::string unit_ = "1";
};

}  // namespace axiscal
