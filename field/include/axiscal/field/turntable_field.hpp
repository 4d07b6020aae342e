// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// A field of the kind `induced_rotation`: the rotation of a turntable about the table's normal.
/// The level of a reading multiplies the rate. If a local field is added to it, only the component
/// of the local field along the axis of rotation counts while the table turns.
class AXISCAL_EXPORT TurntableField final : public ReferenceField {
 public:
  /// A turntable whose rate the experiment states as the field's magnitude.
  TurntableField() = default;

  /// @param rate  rate at level 1, positive [unit].
  /// @param unit  "deg/s", "rad/s" or "deg/h".
  /// @throws DomainError  if the rate is not positive and finite.
  explicit TurntableField(double rate, std::string unit = "deg/s");

  /// @return the rate along the table's normal [unit()]; zero if it is not stated.
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return {0.0, 0.0, rate_}; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "induced_rotation"; }
  [[nodiscard]] bool is_induced() const override { return true; }

  void state(FieldSetup& setup) const override;
  void resolve(FieldResolver& of) const override;

 private:
  double rate_ = 0.0;
  std::string unit_;
};

}  // namespace axiscal
