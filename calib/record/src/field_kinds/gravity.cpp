// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/gravity_field.hpp"
#include "part_resolver.hpp"

namespace axiscal {
namespace {

// What gravity models are off by from gravity on the ground (1 standard deviation) [m/s^2]: WGS 84
// normal gravity knows no anomalies; EGM96 and EGM2008 leave out what is smaller than their grid.
// Measured at 2872 ground stations of southern Africa (Proof in docs/fields.md).
constexpr double normal_gravity_u = 4e-4;
constexpr double gravity_model_u = 2e-4;

}  // namespace

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
    of.put_magnitude(GravityField(of.site(), model).magnitude());
    of.part().model = model;
    of.put_model_u(model == "wgs84" ? normal_gravity_u : gravity_model_u);
  }
  if (of.part().unit == "g" && of.has_site()) {
    of.part().local_gravity = GravityField(of.site(), model).magnitude() / of.part().part.magnitude;
    of.part().model = model;
  }
  of.put_value(Eigen::Vector3d::UnitZ(), false);
  of.part().has_heading = true;
}

}  // namespace axiscal
