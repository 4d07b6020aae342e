// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Specific force on an instrument at rest: gravity, reversed.
///
/// The support pushes the instrument up, so the vector points up along the plumb line: (0, 0, g).
///
/// @code
/// axiscal::GravityField in_g;                                        // (0, 0, 1) g
/// axiscal::GravityField in_si(axiscal::Site{.latitude_deg = 52.0});  // (0, 0, 9.8122...) m/s^2
/// @endcode
class GravityField final : public ReferenceField {
 public:
  /// In units of local gravity: magnitude 1, unit `g`. No site is needed.
  GravityField() = default;

  /// WGS 84 normal gravity at a site, in m/s^2.
  ///
  /// Local gravity anomalies are not modelled; they are usually below 1e-3 m/s^2.
  /// @throws DomainError  if a member of `site` is not finite or out of range.
  /// @par Source
  /// Heiskanen & Moritz, Physical Geodesy (1967), secs. 2-7 and 2-8; evaluated by GeographicLib.
  explicit GravityField(const Site& site);

  /// A measured local value.
  ///
  /// @param magnitude  length of the specific force, positive [unit].
  /// @param unit       "g" or "m/s^2".
  /// @throws DomainError  if the magnitude is not positive and finite.
  GravityField(double magnitude, std::string unit);

  /// @return specific force [unit()], frame enu: (0, 0, magnitude).
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return {0.0, 0.0, magnitude_}; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "gravity"; }

 private:
  double magnitude_ = 1.0;
  std::string unit_ = "g";
};

}  // namespace axiscal
