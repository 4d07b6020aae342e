// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/timestamp.hpp"
#include "axiscal/field/geomagnetic_field.hpp"
#include "part_resolver.hpp"

namespace axiscal {

void resolve_geomagnetic(PartResolver& of) {
  if (of.has_site()) {
    of.require_longitude();
    const GeomagneticModel model(of.given().model.empty() ? "wmm2025" : of.given().model);
    const GeomagneticField field(of.site(), decimal_year_of(of.date_s()), of.part().unit, model);
    of.put_magnitude(of.given_magnitude().value_or(field.magnitude()));
    if (!of.given_magnitude()) {
      of.put_model_u(field.magnitude_uncertainty());
    }
    of.part().model = model.name();
    of.put_value(field.value_in_enu(), false);
    return;
  }
  of.put_given_magnitude("its magnitude is not known; state it, or the site", {Setting::site});
}

}  // namespace axiscal
