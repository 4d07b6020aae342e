// SPDX-License-Identifier: Apache-2.0
// Replaces earth_models.cpp in a build without GeographicLib; both functions throw. Gravity of 1 g
// and fields that are stated as numbers do not need them.
#include "axiscal/core/error.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "axiscal/field/settings.hpp"
#include "field/src/earth_models.hpp"

namespace axiscal {

std::shared_ptr<const GeomagneticModel::Coefficients> geomagnetic_coefficients(
    const std::string& /*model*/) {
  throw SetupError(
      "this build has no model of the Earth's magnetic field: build axiscal with GeographicLib, or "
      "give the field's magnitude and direction",
      {settings::field_magnitude});
}

Eigen::Vector3d gravity_in_enu(const Site& site, const std::string& /*model*/) {
  check_site(site);
  throw SetupError(
      "this build has no model of gravity at a site: build axiscal with GeographicLib, or give the "
      "field's magnitude",
      {settings::field_magnitude});
}

}  // namespace axiscal
