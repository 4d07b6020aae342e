// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/field/induced_field.hpp"
#include "axiscal/field/sun.hpp"
#include "part_resolver.hpp"

namespace axiscal {
namespace {

void resolve_sun(PartResolver& of) {
  if (!of.has_site()) {
    throw SetupError("the sun's place needs the site: latitude and longitude", {Setting::site});
  }
  if (!of.knows_time()) {
    return;  // the readings' times are not known yet, or there are none
  }
  of.require_longitude();
  const double at_s = of.reading_time_s().value_or(of.date_s());
  const SunPosition sun = sun_position(of.site(), at_s, of.given().refraction);
  if (!(sun.elevation_rad > 0.0)) {
    const std::string what =
        "at the time of the readings the sun is below the horizon; check the site, and that "
        "times "
        "are in UTC";
    if (of.reading_time_s()) {
      throw RefusedError(what);
    }
    throw SetupError(what);
  }
  of.part().model = "sun";
  of.put_value(sun.direction_in_enu, false);
}

}  // namespace

void resolve_light(PartResolver& of) {
  if (of.part().unit != "1" && !of.given_magnitude() && of.given().lamps.empty()) {
    throw SetupError(
        formatted("field light in {}: its magnitude is not known; state it", of.part().unit),
        {Setting::field_magnitude});
  }
  of.put_magnitude(of.given_magnitude().value_or(1.0));
  if (of.given().sun) {
    resolve_sun(of);
  } else if (!of.given().lamps.empty()) {
    of.put_made([&]() -> Eigen::Vector3d { return lamps_in_table(of.given().lamps); });
    for (const Lamp& lamp : of.given().lamps) {
      of.part().lamps.push_back(lamp.direction_in_table.normalized());
    }
  }
}

}  // namespace axiscal
