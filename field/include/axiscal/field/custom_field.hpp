// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// Any constant field, given as a vector: a coil's, a lamp's, one that was measured.
class CustomField final : public ReferenceField {
 public:
  /// @param value_in_enu  the field [unit], frame enu; not zero.
  /// @param unit          any text; "1" for a field in units of itself.
  /// @throws DomainError  if the vector is zero or not finite.
  explicit CustomField(const Eigen::Vector3d& value_in_enu, std::string unit = "1");

  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return value_in_enu_; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "custom"; }

 private:
  Eigen::Vector3d value_in_enu_;
  std::string unit_;
};

}  // namespace axiscal
