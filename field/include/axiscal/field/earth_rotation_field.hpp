// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Angular rate of the Earth against the stars [rad/s], WGS 84.
inline constexpr double earth_rate_rad_per_s = 7.292115e-5;

/// The Earth's rotation at a site: w (0, cos latitude, sin latitude).
class EarthRotationField final : public ReferenceField {
 public:
  /// @param site  latitude counts.
  /// @param unit  "rad/s", "deg/s" or "deg/h".
  /// @throws DomainError  for a bad site or unit.
  explicit EarthRotationField(const Site& site, std::string unit = "rad/s");

  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return value_; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "earth_rotation"; }

 private:
  Eigen::Vector3d value_;
  std::string unit_;
};

}  // namespace axiscal
