// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Angular rate of the Earth against the stars [rad/s], WGS 84.
inline constexpr double earth_rate_rad_per_s = 7.292115e-5;

/// The Earth's rotation at a site: earth_rate_rad_per_s (0, cos latitude, sin latitude), frame enu.
class AXISCAL_EXPORT EarthRotationField final : public ReferenceField {
 public:
  /// The rotation at the table's site.
  EarthRotationField() = default;

  /// @param site  only its latitude is used.
  /// @param unit  "rad/s", "deg/s" or "deg/h".
  /// @throws DomainError  if the site is out of range, or for another unit.
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
  std::optional<Site> site_;  // the field's own site; nullopt: the table's site
};

}  // namespace axiscal
