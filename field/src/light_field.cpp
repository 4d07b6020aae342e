// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/light_field.hpp"

#include <array>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/settings.hpp"
#include "axiscal/field/sun.hpp"
#include "core/formatted.hpp"
#include "core/json_members.hpp"
#include "field/src/field_entries.hpp"

namespace axiscal {

Eigen::Vector3d lamps_in_table(const std::vector<Lamp>& lamps) {
  if (lamps.empty()) {
    throw DomainError("lamps: at least one lamp is needed");
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : lamps) {
    if (!(lamp.irradiance > 0.0) || !(lamp.direction_in_table.norm() > 0.0)) {
      throw DomainError("a lamp needs a direction that is not zero, and a positive irradiance");
    }
    sum += lamp.irradiance * lamp.direction_in_table.normalized();
  }
  return sum;
}

LightField::LightField(std::vector<Lamp> lamps, std::string unit)
    : lamps_(std::move(lamps)), unit_(std::move(unit)) {
  static_cast<void>(lamps_in_table(lamps_));
}

LightField LightField::sun(bool refraction) {
  LightField field;
  field.is_sun_ = true;
  field.refraction_ = refraction;
  return field;
}

Eigen::Vector3d LightField::value_in_enu() const {
  return lamps_.empty() ? Eigen::Vector3d::Zero() : lamps_in_table(lamps_);
}

void LightField::state(FieldSetup& setup) const {
  setup.unit = unit_;
}

Eigen::Vector3d LightField::moving_in_table(const TablePlace& place, double time_s) const {
  if (!place.site) {
    throw SetupError("to compute the sun's position, give the site: latitude and longitude",
                     {settings::site});
  }
  return rotation_of_moving(place, *this) *
         sun_position(*place.site, time_s, refraction_).direction_in_enu;
}

void LightField::resolve(FieldResolver& of) const {
  if (lamps_.empty() || of.may_be_open()) {
    of.set_given_magnitude_or_1(
        formatted(" in {}: its magnitude is unknown; give the magnitude", of.found().unit), {});
  }
  if (is_sun_) {
    resolve_sun(of);
  } else if (!lamps_.empty()) {
    of.set_made([&]() -> Eigen::Vector3d { return lamps_in_table(lamps_); });
    for (const Lamp& lamp : lamps_) {
      of.found().start.lamps.push_back(lamp.direction_in_table.normalized());
    }
  }
}

void LightField::resolve_sun(FieldResolver& of) const {
  if (!of.site()) {
    throw SetupError("to compute the sun's position, give the site: latitude and longitude",
                     {settings::site});
  }
  if (!of.is_time_of_day_known()) {
    return;  // the times of the readings are not known yet, or the readings have none
  }
  of.require_longitude();
  const double at_s = of.reading_time_s().value_or(of.date_s());
  const SunPosition sun = sun_position(*of.site(), at_s, refraction_);
  if (!(sun.elevation_rad > 0.0)) {
    const std::string what =
        "at the time of the readings the sun is below the horizon; check the site, and that times "
        "are in UTC";
    if (of.reading_time_s()) {
      throw RefusedError(what);
    }
    throw SetupError(what);
  }
  of.found().model = "sun";
  of.set_direction(sun.direction_in_enu, false);
}

void LightField::members(JsonMembers& io) {
  if (io.reads() || !lamps_.empty()) {
    io.list("lamps", lamps_, [](JsonMembers& one, Lamp& lamp) {
      static constexpr std::array<std::string_view, 2> keys = {"direction_in_table", "irradiance"};
      one.allow_keys(keys);
      one.need_vector("direction_in_table", lamp.direction_in_table, 3);
      one.value("irradiance", lamp.irradiance);
    });
  }
  if (io.reads() && io.from().find("lamps")) {
    io.check("lamps", [&] { static_cast<void>(lamps_in_table(lamps_)); });
  }
  std::string source = is_sun_ ? "sun" : "";
  io.value_if_any("source", source);
  if (!source.empty()) {
    io.check("source", source == "sun" || source == "lamp", "must be 'sun' or 'lamp'");
    is_sun_ = source == "sun";
  }
  io.flag_unless("refraction", refraction_, false);
}

FieldKind light_entry() {
  static constexpr std::array<std::string_view, 3> units = {"1", "W/m^2", "lux"};
  static constexpr std::array<std::string_view, 3> members = {"lamps", "source", "refraction"};
  return {.name = "light", .units = units, .members = members, .make = maker_of<LightField>()};
}

}  // namespace axiscal
