// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/units.hpp"
#include "axiscal/field/coil_field.hpp"
#include "axiscal/field/custom_field.hpp"
#include "axiscal/field/earth_rotation_field.hpp"
#include "axiscal/field/field_description.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_level.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/field_role.hpp"
#include "axiscal/field/field_setup.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/field/geomagnetic_field.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "axiscal/field/induced_field.hpp"
#include "axiscal/field/light_field.hpp"
#include "axiscal/field/recorded_field.hpp"
#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/settings.hpp"
#include "axiscal/field/site.hpp"
#include "axiscal/field/sun.hpp"
#include "axiscal/field/table_field.hpp"
#include "axiscal/field/table_place.hpp"
#include "axiscal/field/turntable_field.hpp"

/// @file
/// Reference fields for a calibration: vectors that are known at a site.
///
/// A ReferenceField is a vector in enu (east, north, up) with a unit. The library provides gravity,
/// the geomagnetic field, the Earth's rotation, the fields of coils and turntables, and the light
/// of lamps and of the sun. Derive a class from ReferenceField to add your own field. FieldKind
/// contains the properties that all fields of one kind share.
///
/// @code
/// const axiscal::Site munich{.latitude_deg = 48.14, .longitude_deg = 11.58, .height_m = 520.0};
/// const axiscal::GravityField gravity(munich);
/// const axiscal::GeomagneticField magnetic(munich, 2026.5);
/// const double down_rad = axiscal::inclination_of(magnetic.value_in_enu());
/// std::printf("%.5f m/s^2, %.0f nT, %.1f degrees down\n", gravity.magnitude(),
///             magnetic.magnitude(), down_rad * axiscal::deg_per_rad);
/// @endcode
///
/// Traps:
/// - The sign of gravity is that of the specific force, which an accelerometer at rest measures: it
///   points up, (0, 0, +g).
/// - Heights are above the WGS 84 ellipsoid, not above sea level.
/// - GravityField() without a site is 1 g, in units of local gravity. For results in m/s^2, give
///   the site or a measured value.
