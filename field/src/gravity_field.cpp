// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/gravity_field.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/settings.hpp"
#include "core/formatted.hpp"
#include "core/json_members.hpp"
#include "field/src/field_entries.hpp"
#include "field/src/field_members.hpp"

namespace axiscal {
namespace {

// Standard deviations of the errors of gravity models on the ground [m/s^2]. WGS 84 normal gravity
// does not include anomalies. EGM96 and EGM2008 do not include details that are smaller than their
// grid. The values are from a comparison with gravity measured at 2872 stations in southern Africa.
constexpr double normal_gravity_u = 4e-4;
constexpr double gravity_model_u = 2e-4;

}  // namespace

GravityField::GravityField(const Site& site, const std::string& model)
    : GravityField(gravity_in_enu(site, model).norm(),
                   "m/s^2",
                   model == "wgs84" ? normal_gravity_u : gravity_model_u) {
  is_measured_ = false;
  site_ = site;
  model_ = model;
}

GravityField::GravityField(double magnitude, std::string unit, double magnitude_u)
    : magnitude_(magnitude), unit_(std::move(unit)), magnitude_u_(magnitude_u), is_measured_(true) {
  if (!(magnitude > 0.0) || !std::isfinite(magnitude)) {
    throw DomainError("GravityField: the magnitude must be positive and finite");
  }
  if (!(magnitude_u >= 0.0)) {
    throw DomainError("GravityField: the uncertainty must not be negative");
  }
}

void GravityField::state(FieldSetup& setup) const {
  if (is_measured_ || site_) {
    setup.unit = unit_;
  }
  if (is_measured_) {
    setup.magnitude = magnitude_;
    setup.magnitude_u = magnitude_u_;
  }
}

void GravityField::resolve(FieldResolver& of) const {
  FieldDescription& found = of.found();
  const std::optional<Site>& site = site_ ? site_ : of.site();
  of.set_magnitude(1.0);
  if (const std::optional<double> magnitude = of.given_magnitude()) {
    of.set_magnitude(*magnitude);
  } else if (found.unit != "g" && !site && of.largest_field_length()) {
    of.set_magnitude(*of.largest_field_length());
  } else if (found.unit != "g") {
    if (!site) {
      throw SetupError(
          "field gravity in m/s^2: its magnitude is unknown; give the magnitude, or latitude and "
          "height of the site",
          {settings::field_magnitude, settings::site});
    }
    const GravityField there(*site, model_);
    of.set_magnitude(there.magnitude());
    found.model = model_;
    of.set_model_u(there.magnitude_uncertainty());
  }
  if (found.unit == "g" && site) {
    const GravityField there(*site, model_);
    found.local_gravity = there.magnitude() / found.magnitude;
    found.local_gravity_u = there.magnitude_uncertainty() / found.magnitude;
    found.model = model_;
  }
  of.set_direction(Eigen::Vector3d::UnitZ(), false);
  found.start.has_heading = true;
}

void GravityField::members(JsonMembers& io) {
  model_members(io, model_, "wgs84");
  site_members(io, site_);
}

FieldKind gravity_entry() {
  static constexpr std::array<std::string_view, 2> units = {"g", "m/s^2"};
  return {.name = "gravity",
          .units = units,
          .local = true,
          .vertical = true,
          .along_normal = true,
          .least_magnitude = 0.99,  // 0.9956 g (high altitude, equator) to 1.0026 g (poles)
          .greatest_magnitude = 1.01,
          .members = members_with_site,
          .make = maker_of<GravityField>()};
}

}  // namespace axiscal
