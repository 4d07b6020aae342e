// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Angular rate of the Earth relative to the stars [rad/s], by WGS 84.
inline constexpr double earth_rate_rad_per_s = 7.292115e-5;

/// The Earth's rotation at a site. Its vector in enu is (0, cos latitude, sin latitude) times
/// earth_rate_rad_per_s.
class AXISCAL_EXPORT EarthRotationField final : public ReferenceField {
 public:
  /// The Earth's rotation at the table's site.
  EarthRotationField() = default;

  /// @param site  only its latitude is used.
  /// @param unit  "rad/s", "deg/s" or "deg/h".
  /// @throws DomainError  if the site is out of range, or the unit is not one of these.
  explicit EarthRotationField(const Site& site, std::string unit = "rad/s");

  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return value_; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "earth_rotation"; }

  void state(FieldSetup& setup) const override;
  void resolve(FieldResolver& of) const override;
  void members(JsonMembers& io) override;

 private:
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero();
  std::string unit_;
  std::optional<Site> site_;  // site of the field; nullopt if it is the table's site
};

}  // namespace axiscal
