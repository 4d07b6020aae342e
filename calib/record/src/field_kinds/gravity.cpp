// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/gravity_field.hpp"
#include "part_resolver.hpp"

namespace axiscal {
void resolve_gravity(PartResolver& of) {
  const std::string model = of.given().model.empty() ? "wgs84" : of.given().model;
  of.put_magnitude(1.0);
  if (const std::optional<double> magnitude = of.given_magnitude()) {
    of.put_magnitude(*magnitude);
  } else if (of.part().unit != "g") {
    if (!of.has_site()) {
      throw SetupError(
          "field gravity in m/s^2: its magnitude is not known; state it, or latitude and height of "
          "the site",
          {Setting::field_magnitude, Setting::site});
    }
    const GravityField there(of.site(), model);
    of.put_magnitude(there.magnitude());
    of.part().model = model;
    of.put_model_u(there.magnitude_uncertainty());
  }
  if (of.part().unit == "g" && of.has_site()) {
    const GravityField there(of.site(), model);
    of.part().local_gravity = there.magnitude() / of.part().part.magnitude;
    of.part().local_gravity_u = there.magnitude_uncertainty() / of.part().part.magnitude;
    of.part().model = model;
  }
  of.put_value(Eigen::Vector3d::UnitZ(), false);
  of.part().has_heading = true;
}

}  // namespace axiscal
