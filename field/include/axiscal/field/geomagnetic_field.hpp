// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Standard uncertainties of the field that a geomagnetic model computes for a place.
struct AXISCAL_EXPORT GeomagneticUncertainty {
  Eigen::Vector3d in_enu_nT =
      Eigen::Vector3d::Zero();  ///< standard uncertainties of the east, north and up components
  double magnitude_nT = 0.0;
  double inclination_rad = 0.0;
  /// Standard uncertainty of the declination; it grows with the inclination of the field.
  double declination_rad = 0.0;
};

/// A spherical harmonic model of the geomagnetic field.
///
/// `wmm2025` is built in: its coefficients are arrays in the library, so no file is read, written
/// or downloaded. GeographicLib's SphericalHarmonic1 computes the field from these arrays, because
/// MagneticModel accepts only files. Any other name is a model that the user has installed for
/// GeographicLib (`igrf14`, `emm2017`, ...). GeographicLib finds the model by its own search path
/// and environment variables. If a model has a degree above 12, create it before another thread
/// evaluates any model, because its creation extends a table that all models share.
class AXISCAL_EXPORT GeomagneticModel {
 public:
  /// @throws DataError  if no such model is installed; the message gives the folder that was
  ///                    searched.
  explicit GeomagneticModel(const std::string& name = "wmm2025");

  /// Computes the field at a place and time.
  ///
  /// @param site  the place, with its height above the WGS 84 ellipsoid.
  /// @param year  decimal year.
  /// @return field [nT], frame enu.
  /// @throws RefusedError  if height or year are outside the model's range; the message gives the
  ///                       range.
  [[nodiscard]] Eigen::Vector3d value_in_enu_nT(const Site& site, double year) const;

  /// Returns the model's uncertainty at a given value of the field, by the error model that the
  /// model's authors published.
  ///
  /// @return nullopt if no error model is known for this model.
  /// @par Source
  /// The US/UK World Magnetic Model for 2025-2030: Technical Report (NOAA 2025). Its standard
  /// uncertainties are 137 nT (north), 89 nT (east), 141 nT (down), 138 nT (magnitude), 0.20
  /// degrees (inclination), and sqrt(0.26^2 + (5417 nT / H)^2) degrees (declination), where H is
  /// the horizontal magnitude.
  [[nodiscard]] std::optional<GeomagneticUncertainty> uncertainty(
      const Eigen::Vector3d& value_in_enu_nT) const;

  [[nodiscard]] const std::string& name() const { return name_; }

  class Coefficients;  ///< implementation detail

 private:
  std::string name_;
  std::shared_ptr<const Coefficients> coefficients_;
};

/// @return the angle of the field below the horizontal [rad].
/// @param value_in_enu  the field in enu, or in the frame of a level table.
[[nodiscard]] AXISCAL_EXPORT double inclination_of(const Eigen::Vector3d& value_in_enu);

/// @return the angle from north to the field's horizontal part [rad], east positive, in (-pi, pi].
[[nodiscard]] AXISCAL_EXPORT double declination_of(const Eigen::Vector3d& value_in_enu);

/// The Earth's magnetic field at a place and time. With the magnitude F, the inclination I and the
/// declination D, it is F (cos I sin D, cos I cos D, -sin I) in enu.
///
/// @code
/// axiscal::GeomagneticField field({.latitude_deg = 48.1, .longitude_deg = 11.6}, 2026.5);
/// @endcode
class AXISCAL_EXPORT GeomagneticField final : public ReferenceField {
 public:
  /// The field computed by the built-in model for the table's site and date.
  GeomagneticField() = default;

  /// @param site   the place.
  /// @param year   decimal year.
  /// @param unit   "nT", "uT", "T" or another magnetic unit.
  /// @param model  the geomagnetic model.
  /// @throws DomainError  if the site is out of range, or the unit is not magnetic.
  /// @throws DataError, RefusedError  for the same reasons as GeomagneticModel.
  GeomagneticField(const Site& site,
                   double year,
                   std::string unit = "nT",
                   const GeomagneticModel& model = GeomagneticModel());

  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return value_; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "geomagnetic"; }
  [[nodiscard]] double magnitude_uncertainty() const override { return magnitude_u_; }

  void state(FieldSetup& setup) const override;
  void resolve(FieldResolver& of) const override;
  void members(JsonMembers& io) override;

 private:
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero();
  std::string unit_;
  double magnitude_u_ = 0.0;
  std::optional<Site> site_;  // site of the field; nullopt if it is the table's site
  double year_ = 0.0;         // decimal year for site_
  std::string model_ = "wmm2025";
};

}  // namespace axiscal
