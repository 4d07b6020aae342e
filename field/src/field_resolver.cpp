// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_resolver.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/field/settings.hpp"
#include "core/formatted.hpp"

namespace axiscal {

FieldResolver::FieldResolver(const FieldSetup& part,
                             const TablePlace& place,
                             const FieldOccasion& occasion,
                             bool beside_others)
    : given_(part), place_(place), occasion_(occasion), beside_others_(beside_others) {
  found_.unit = part.unit;
  found_.name = part.name;
}

FieldDescription FieldResolver::resolve() {
  check_given();
  if (!given_.of) {
    throw SetupError("the field is missing; the known fields are: " + list_of_field_kinds(),
                     {settings::field});
  }
  prepare();
  given_.of->resolve(*this);
  if (given_.in_table) {
    found_.in_table = given_.in_table;
    found_.start.has_heading = true;
    found_.start.sign_by = given_.in_table->normalized();
  }
  if (given_.magnitude_unknown) {
    mark_magnitude_unknown();
  }
  return std::move(found_);
}

void FieldResolver::check_given() const {
  if (given_.in_table && !(given_.in_table->norm() > 0.0 && given_.in_table->norm() < 1e150)) {
    throw SetupError(
        "the field's vector in the table's frame must be shorter than 1e150 and not zero",
        {settings::field_table});
  }
  if (given_.magnitude && !(*given_.magnitude > 0.0 && std::isfinite(*given_.magnitude))) {
    throw SetupError("the field's magnitude must be a positive number",
                     {settings::field_magnitude});
  }
  if (given_.magnitude && given_.magnitude_unknown) {
    throw SetupError(
        "the field's magnitude is given as a number and also as 'unknown'; give only one of the "
        "two",
        {settings::field_magnitude});
  }
  if (!(given_.magnitude_u >= 0.0)) {
    throw SetupError("the uncertainty of the field's magnitude must not be negative",
                     {settings::field_magnitude_u});
  }
}

// Sets kind, unit and role from the stated inputs and the kind's properties.
void FieldResolver::prepare() {
  const FieldKind& kind = field_kind(given_.kind());
  found_.kind = given_.kind();
  if (found_.unit.empty()) {
    found_.unit = unit_from_magnitude(kind);
  }
  if (found_.unit.empty()) {
    found_.unit = given_.of->unit();
  }
  if (found_.unit.empty()) {
    found_.unit = unit_unless_stated(kind);
  }
  check_field_unit(found_.kind, found_.unit);
  if (kind.local && given_.role == FieldRole::induced) {
    throw SetupError(
        formatted("field {}: its role must be 'local', because the site determines "
                  "this field",
                  found_.kind));
  }
  found_.set_by_level = given_.is_induced();
}

void FieldResolver::resolve_by_value(const ReferenceField& field) {
  if (given_.magnitude && !(std::abs(*given_.magnitude / field.magnitude() - 1.0) <= 1e-9)) {
    throw SetupError(
        formatted("field {}: the field object of the program already has the magnitude {} {}; "
                  "remove the magnitude {} from the settings",
                  field.kind(), number_text(field.magnitude()), field.unit(),
                  number_text(*given_.magnitude)));
  }
  if (given_.role && (*given_.role == FieldRole::induced) != field.is_induced()) {
    throw SetupError(
        formatted("field {}: the program's own field already has a role; remove the stated role",
                  field.kind()));
  }
  found_.magnitude = field.magnitude();
  set_model_u(field.magnitude_uncertainty());
  if (!field.moves()) {
    set_direction(field.value_in_enu(), field.is_induced());
  } else if (is_time_of_day_known()) {
    const Eigen::Vector3d value = field.value_in_enu_at(occasion_.time_s.value_or(date_s()));
    found_.magnitude = value.norm();
    set_direction(value, field.is_induced());
  }
}

// Returns the first unit of the kind in which the stated magnitude is possible, e.g. m/s^2 for a
// gravity of 9.81, uT for a geomagnetic field of 48. Returns "" if there is no such unit.
std::string FieldResolver::unit_from_magnitude(const FieldKind& kind) const {
  const std::optional<double> met = kind.vertical ? occasion_.largest : std::nullopt;
  const std::optional<double> magnitude = given_magnitude() ? given_magnitude() : met;
  for (const std::string_view unit : kind.units) {
    if (magnitude && kind.greatest_magnitude > 0.0 &&
        is_possible_magnitude(kind, *magnitude, unit)) {
      return std::string(unit);
    }
  }
  return "";
}

// Returns the unit of the readings if no number of the field is stated and the kind allows this
// unit. Otherwise returns the kind's first unit.
std::string FieldResolver::unit_unless_stated(const FieldKind& kind) const {
  const std::string& of_readings = occasion_.reading_unit;
  const bool has_number = given_.magnitude || given_.in_table || given_.magnitude_u > 0.0;
  if (!has_number && !kind.vertical &&
      std::find(kind.units.begin(), kind.units.end(), of_readings) != kind.units.end() &&
      of_readings != "1") {
    return of_readings;
  }
  return kind.units.empty() ? "1" : std::string(kind.units.front());
}

void FieldResolver::require_longitude() const {
  if (!place_.has_longitude) {
    throw SetupError(formatted("field {}: the site's longitude is missing", found_.kind),
                     {settings::longitude});
  }
}

bool FieldResolver::is_time_of_day_known() const {
  return occasion_.time_s || place_.date.find('T') != std::string::npos;
}

double FieldResolver::date_s() const {
  if (place_.date.empty()) {
    return output_seconds();
  }
  const std::optional<double> time_s = parse_date(place_.date);
  if (!time_s) {
    throw SetupError(formatted("the date '{}' is neither ISO 8601 nor a decimal year", place_.date),
                     {settings::date});
  }
  return *time_s;
}

std::optional<double> FieldResolver::given_magnitude() const {
  if (given_.magnitude) {
    return given_.magnitude;
  }
  return given_.in_table ? std::optional<double>(given_.in_table->norm()) : std::nullopt;
}

void FieldResolver::set_magnitude(double magnitude) {
  found_.magnitude = magnitude;
  found_.magnitude_u = given_.magnitude_u;
}

void FieldResolver::set_model_u(double magnitude_u) {
  found_.magnitude_u = given_.magnitude_u > 0.0 ? given_.magnitude_u : magnitude_u;
}

bool FieldResolver::may_be_open() const {
  return given_.magnitude_unknown || (beside_others_ && !found_.set_by_level && !given_magnitude());
}

void FieldResolver::mark_magnitude_unknown() {
  found_.free_length = true;
  set_magnitude(given_magnitude().value_or(1.0));
}

void FieldResolver::set_given_magnitude(const std::string& otherwise,
                                        std::vector<Setting> settings) {
  if (given_magnitude()) {
    set_magnitude(*given_magnitude());
  } else if (may_be_open()) {
    mark_magnitude_unknown();
  } else if (occasion_.largest) {
    set_magnitude(*occasion_.largest);
  } else {
    settings.push_back(settings::field_magnitude);
    throw SetupError(formatted("field {}{}", found_.kind, otherwise), std::move(settings));
  }
}

void FieldResolver::set_given_magnitude_or_1(const std::string& otherwise,
                                             std::vector<Setting> settings) {
  if (given_magnitude() || may_be_open() || occasion_.largest || found_.unit != "1") {
    set_given_magnitude(otherwise, std::move(settings));
  } else {
    set_magnitude(1.0);
  }
}

void FieldResolver::set_direction(const Eigen::Vector3d& value, bool induced) {
  const double azimuth_rad = induced ? 0.0 : place_.fence_azimuth_rad.value_or(0.0);
  Eigen::Vector3d in_table = rotation_table_from_enu(azimuth_rad) * value;
  if (!induced) {
    in_table = rotation_sloping_from_level(place_.slope) * in_table;
  }
  found_.in_table = found_.magnitude * in_table.normalized();
  const Eigen::Vector3d direction = value.normalized();
  constexpr double nearly_vertical = 0.98;
  found_.start.has_heading =
      induced || place_.fence_azimuth_rad.has_value() || std::abs(direction.z()) > nearly_vertical;
  // If the heading is unknown, only the vertical component can select the sign of the field.
  constexpr double clearly_inclined = 0.2;
  if (found_.start.has_heading) {
    found_.start.sign_by = in_table.normalized();
  } else if (std::abs(direction.z()) > clearly_inclined) {
    found_.start.sign_by = {0.0, 0.0, direction.z()};
  }
}

void FieldResolver::set_made(const std::function<Eigen::Vector3d()>& make) {
  Eigen::Vector3d value;
  try {
    value = make();
  } catch (const DomainError& error) {
    throw SetupError(formatted("field {}: {}", found_.kind, error.what()), error.settings());
  }
  set_magnitude(given_magnitude().value_or(value.norm()));
  found_.in_table = found_.magnitude * value.normalized();
  found_.start.sign_by = value.normalized();
}

}  // namespace axiscal
