// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Computes the specific force on a body at rest, which is opposite to gravity, by a gravity model.
///
/// @param model  "wgs84" (normal gravity, built in), or a gravity model ("egm96", "egm2008") that
///               is installed in GeographicLib's search path.
/// @return specific force [m/s^2], frame enu. With an installed model it is not exactly vertical,
///         because the plumb line is not the ellipsoid's normal.
/// @throws DomainError  if the site is out of range.
/// @throws DataError    if the model is not installed; the message gives the folder that was
///                      searched.
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d gravity_in_enu(const Site& site,
                                                            const std::string& model = "wgs84");

/// The specific force on an instrument at rest: gravity with the opposite sign.
///
/// The support pushes the instrument up, so the vector points up along the plumb line: (0, 0, g).
///
/// @code
/// axiscal::GravityField in_g;                                        // (0, 0, 1) g
/// axiscal::GravityField in_si(axiscal::Site{.latitude_deg = 52.0});  // (0, 0, 9.8122...) m/s^2
/// @endcode
class AXISCAL_EXPORT GravityField final : public ReferenceField {
 public:
  /// Gravity in units of local gravity: magnitude 1, unit `g`. No site is needed.
  GravityField() = default;

  /// Gravity at a site [m/s^2], computed by a model.
  ///
  /// WGS 84 normal gravity does not include local anomalies. The standard deviation of its error is
  /// a few 1e-4 m/s^2; errors above 1e-3 m/s^2 are rare. Only the length of the model's vector is
  /// used. The direction is up, because the table is levelled by the plumb line.
  /// @param site   the place.
  /// @param model  the gravity model, see gravity_in_enu().
  /// @throws DomainError  if a member of `site` is not finite or out of range.
  /// @throws DataError    if the model is not installed.
  /// @par Source
  /// Heiskanen & Moritz, Physical Geodesy (1967), secs. 2-7 and 2-8; evaluated by GeographicLib.
  explicit GravityField(const Site& site, const std::string& model = "wgs84");

  /// Gravity with a measured magnitude.
  ///
  /// @param magnitude    length of the specific force, positive [unit].
  /// @param unit         "g" or "m/s^2".
  /// @param magnitude_u  standard uncertainty of the magnitude [unit].
  /// @throws DomainError  if the magnitude is not positive and finite.
  GravityField(double magnitude, std::string unit, double magnitude_u = 0.0);

  /// @return specific force [unit()], frame enu: (0, 0, magnitude).
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return {0.0, 0.0, magnitude_}; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "gravity"; }
  [[nodiscard]] double magnitude_uncertainty() const override { return magnitude_u_; }

  void state(FieldSetup& setup) const override;
  void resolve(FieldResolver& of) const override;
  void members(JsonMembers& io) override;

 private:
  double magnitude_ = 1.0;
  std::string unit_ = "g";
  double magnitude_u_ = 0.0;
  bool is_measured_ = false;  // true if the magnitude was stated
  std::optional<Site> site_;  // site of the field; nullopt if it is the table's site
  std::string model_ = "wgs84";
};

/// @return the field of 1 g, in units of local gravity.
[[nodiscard]] inline GravityField gravity() {
  return GravityField();
}

}  // namespace axiscal
