// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/geomagnetic_field.hpp"

#include <cmath>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/field/settings.hpp"
#include "core/formatted.hpp"
#include "core/json_members.hpp"
#include "field/src/earth_models.hpp"
#include "field/src/field_entries.hpp"
#include "field/src/field_members.hpp"

namespace axiscal {

GeomagneticModel::GeomagneticModel(const std::string& name)
    : name_(name), coefficients_(geomagnetic_coefficients(name)) {}

Eigen::Vector3d GeomagneticModel::value_in_enu_nT(const Site& site, double year) const {
  check_site(site);
  const Coefficients::Range range = coefficients_->range();
  if (!(year >= range.first_year && year <= range.last_year)) {
    throw RefusedError(
        formatted("magnetic model {} is valid from {} to {}, not in {}; give another date or model",
                  name_, number_text(range.first_year), number_text(range.last_year),
                  number_text(std::round(year * 1e6) / 1e6)),
        {settings::date, settings::magnetic_model});
  }
  if (!(site.height_m >= range.lowest_m && site.height_m <= range.highest_m)) {
    throw RefusedError(formatted(
        "magnetic model {} is valid from {} to {} m above the ellipsoid, not at {} m", name_,
        number_text(range.lowest_m), number_text(range.highest_m), number_text(site.height_m)));
  }
  return coefficients_->at(site, year);
}

std::optional<GeomagneticUncertainty> GeomagneticModel::uncertainty(
    const Eigen::Vector3d& value_in_enu_nT) const {
  if (name_ != built_in_magnetic_model) {
    return std::nullopt;
  }
  const double horizontal_nT = std::hypot(value_in_enu_nT.x(), value_in_enu_nT.y());
  return GeomagneticUncertainty{
      .in_enu_nT = {89.0, 137.0, 141.0},
      .magnitude_nT = 138.0,
      .inclination_rad = 0.20 * rad_per_deg,
      .declination_rad = std::hypot(0.26, 5417.0 / horizontal_nT) * rad_per_deg};
}

double inclination_of(const Eigen::Vector3d& value_in_enu) {
  return std::atan2(-value_in_enu.z(), std::hypot(value_in_enu.x(), value_in_enu.y()));
}

double declination_of(const Eigen::Vector3d& value_in_enu) {
  return std::atan2(value_in_enu.x(), value_in_enu.y());
}

GeomagneticField::GeomagneticField(const Site& site,
                                   double year,
                                   std::string unit,
                                   const GeomagneticModel& model)
    : unit_(std::move(unit)), site_(site), year_(year), model_(model.name()) {
  const double per_nT = factor_between("nT", unit_);
  const Eigen::Vector3d value_nT = model.value_in_enu_nT(site, year);
  value_ = per_nT * value_nT;
  if (const auto u = model.uncertainty(value_nT)) {
    magnitude_u_ = per_nT * u->magnitude_nT;
  }
}

void GeomagneticField::state(FieldSetup& setup) const {
  setup.unit = unit_;
}

void GeomagneticField::resolve(FieldResolver& of) const {
  if (!site_ && !of.site()) {
    of.set_given_magnitude(": its magnitude is unknown; give the magnitude, or the site",
                           {settings::site});
    return;
  }
  if (!site_) {
    of.require_longitude();
  }
  const GeomagneticField there(site_ ? *site_ : *of.site(),
                               site_ ? year_ : decimal_year_of(of.date_s()), of.found().unit,
                               GeomagneticModel(model_));
  of.set_magnitude(of.given_magnitude().value_or(there.magnitude()));
  if (!of.given_magnitude()) {
    of.set_model_u(there.magnitude_uncertainty());
  }
  of.found().model = model_;
  of.set_direction(there.value_in_enu(), false);
}

void GeomagneticField::members(JsonMembers& io) {
  model_members(io, model_, "wmm2025");
  site_members(io, site_);
  if (site_) {
    io.need("date", year_);
  }
}

FieldKind geomagnetic_entry() {
  return {.name = "geomagnetic",
          .units = magnetic_units,
          .local = true,
          .dated = true,
          .least_magnitude = 20e3,  // the Earth's field: 22,000 nT (South Atlantic) to 67,000 nT
          .greatest_magnitude = 70e3,
          .members = members_with_date,
          .make = maker_of<GeomagneticField>()};
}

}  // namespace axiscal
