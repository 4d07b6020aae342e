// SPDX-License-Identifier: Apache-2.0
#include "part_resolver.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"

namespace axiscal {
namespace {

struct KindResolver {
  std::string_view name;
  void (*resolve)(PartResolver& of);
};

constexpr std::array<KindResolver, 7> kind_resolvers = {{
    {"gravity", &resolve_gravity},
    {"geomagnetic", &resolve_geomagnetic},
    {"earth_rotation", &resolve_earth_rotation},
    {"induced_rotation", &resolve_turntable},
    {"induced_magnetic", &resolve_induced_magnetic},
    {"light", &resolve_light},
    {"custom", &resolve_custom},
}};

void part_refuse_unless(bool good, const std::string& what) {
  if (!good) {
    throw SetupError("field: " + what);
  }
}

}  // namespace

std::string list_of_field_kinds() {
  std::vector<std::string> names;
  for (const FieldKind& kind : field_kinds()) {
    names.emplace_back(kind.name);
  }
  return joined(names);
}

PartResolver::PartResolver(const Experiment& experiment,
                           const FieldPart& part,
                           std::optional<double> time_s)
    : experiment_(experiment), given_(part), time_s_(time_s) {
  part_.unit = part.unit;
  part_.part.kind = part.kind;
}

ResolvedPart PartResolver::resolve() {
  check_given();
  if (given_.custom) {
    resolve_own();
  } else {
    resolve_kind();
  }
  if (given_.in_table) {
    part_.part.in_table = *given_.in_table;
    part_.has_value = true;
    part_.has_heading = true;
    part_.sign_by = given_.in_table->normalized();
  }
  return std::move(part_);
}

void PartResolver::check_given() const {
  if (given_.in_table && !(given_.in_table->norm() > 0.0 && given_.in_table->norm() < 1e150)) {
    throw SetupError("the field's vector in the table must not be zero, and shorter than 1e150",
                     {Setting::field_table});
  }
  if (given_.magnitude && !(*given_.magnitude > 0.0 && std::isfinite(*given_.magnitude))) {
    throw SetupError("the field's magnitude must be a positive number", {Setting::field_magnitude});
  }
  if (!(given_.magnitude_u >= 0.0)) {
    throw SetupError("the uncertainty of the field's magnitude must not be negative",
                     {Setting::field_magnitude_u});
  }
  if (!given_.custom) {
    const std::string& kind = given_.kind;
    part_refuse_unless(!given_.coil || kind == "induced_magnetic", "a coil makes induced_magnetic");
    part_refuse_unless(!(given_.sun || !given_.lamps.empty()) || kind == "light",
                       "lamps and the sun make light");
  }
}

void PartResolver::resolve_own() {
  const ReferenceField& own = *given_.custom;
  if (given_.magnitude && !(std::abs(*given_.magnitude / own.magnitude() - 1.0) <= 1e-9)) {
    throw SetupError(formatted(
        "field {}: a field of one's own states its magnitude itself, {} {}; another one, {}, is "
        "stated beside it: leave one of them out",
        own.kind(), number_text(own.magnitude()), own.unit(), number_text(*given_.magnitude)));
  }
  if (given_.role && (*given_.role == FieldRole::induced) != own.is_induced()) {
    throw SetupError(
        formatted("field {}: a field of one's own states its role itself; leave the other one out",
                  own.kind()));
  }
  part_.part.kind = own.kind();
  part_.unit = own.unit();
  part_.part.magnitude = own.magnitude();
  put_model_u(own.magnitude_uncertainty());
  part_.part.set_by_level = own.is_induced();
  if (!own.moves()) {
    put_value(own.value_in_enu(), own.is_induced());
  } else if (knows_time()) {
    const Eigen::Vector3d value = own.value_in_enu_at(time_s_.value_or(date_s()));
    part_.part.magnitude = value.norm();
    put_value(value, own.is_induced());
  }
}

// The kind's usual one; where no number is stated that would be in it, that of the readings.
std::string PartResolver::unit_unless_stated(const FieldKind& kind) const {
  const std::string& of_readings = experiment_.instrument.unit;
  const bool has_number = given_.magnitude || given_.in_table || given_.magnitude_u > 0.0;
  if (!has_number && !kind.vertical &&
      std::find(kind.units.begin(), kind.units.end(), of_readings) != kind.units.end() &&
      of_readings != "1") {
    return of_readings;
  }
  return kind.units.empty() ? "1" : std::string(kind.units.front());
}

void PartResolver::resolve_kind() {
  if (given_.kind.empty()) {
    throw SetupError("the field is not stated: " + list_of_field_kinds(), {Setting::field});
  }
  check_field_kind(given_.kind);
  const FieldKind& kind = field_kind(given_.kind);
  if (part_.unit.empty()) {
    part_.unit = unit_unless_stated(kind);
  }
  check_field_unit(given_.kind, part_.unit);
  if (kind.local && given_.role == FieldRole::induced) {
    throw SetupError(formatted(
        "field {}: is found at a site, and no one can set it; its role is local", given_.kind));
  }
  part_.part.set_by_level = is_made_on_table(given_);
  const auto* const own =
      std::find_if(kind_resolvers.begin(), kind_resolvers.end(),
                   [&](const KindResolver& one) { return one.name == kind.name; });
  own->resolve(*this);
}

void PartResolver::require_longitude() const {
  if (!experiment_.field.has_longitude) {
    throw SetupError(formatted("field {}: the site's longitude is missing", given_.kind),
                     {Setting::longitude});
  }
}

bool PartResolver::knows_time() const {
  return time_s_ || experiment_.field.date.find('T') != std::string::npos;
}

double PartResolver::date_s() const {
  const std::string& date = experiment_.field.date;
  if (date.empty()) {
    return seconds_now();
  }
  const std::optional<double> time_s = parse_date(date);
  if (!time_s) {
    throw SetupError(formatted("the date '{}' is neither ISO 8601 nor a decimal year", date),
                     {Setting::date});
  }
  return *time_s;
}

std::optional<double> PartResolver::given_magnitude() const {
  if (given_.magnitude) {
    return given_.magnitude;
  }
  return given_.in_table ? std::optional<double>(given_.in_table->norm()) : std::nullopt;
}

void PartResolver::put_magnitude(double magnitude) {
  part_.part.magnitude = magnitude;
  part_.part.magnitude_u = given_.magnitude_u;
}

void PartResolver::put_model_u(double magnitude_u) {
  part_.part.magnitude_u = given_.magnitude_u > 0.0 ? given_.magnitude_u : magnitude_u;
}

void PartResolver::put_value(const Eigen::Vector3d& value, bool induced) {
  const double azimuth_rad = induced ? 0.0 : experiment_.fence_azimuth_rad.value_or(0.0);
  Eigen::Vector3d in_table = rotation_table_from_enu(azimuth_rad) * value;
  if (!induced) {
    in_table = rotation_sloping_from_level(experiment_.slope) * in_table;
  }
  part_.part.in_table = part_.part.magnitude * in_table.normalized();
  part_.has_value = true;
  const Eigen::Vector3d direction = value.normalized();
  constexpr double nearly_vertical = 0.98;
  part_.has_heading = induced || experiment_.fence_azimuth_rad.has_value() ||
                      std::abs(direction.z()) > nearly_vertical;
  // Without the heading only the vertical part says where the field points.
  constexpr double clearly_inclined = 0.2;
  if (part_.has_heading) {
    part_.sign_by = in_table.normalized();
  } else if (std::abs(direction.z()) > clearly_inclined) {
    part_.sign_by = {0.0, 0.0, direction.z()};
  }
}

void PartResolver::put_given_magnitude(const std::string& otherwise,
                                       std::vector<Setting> settings) {
  if (!given_magnitude()) {
    settings.push_back(Setting::field_magnitude);
    throw SetupError(formatted("field {}: {}", given_.kind, otherwise), std::move(settings));
  }
  put_magnitude(*given_magnitude());
}

void PartResolver::put_made(const std::function<Eigen::Vector3d()>& make) {
  Eigen::Vector3d value;
  try {
    value = make();
  } catch (const DomainError& error) {
    throw SetupError(formatted("field {}: {}", given_.kind, error.what()), error.settings());
  }
  put_magnitude(given_magnitude().value_or(value.norm()));
  part_.part.in_table = part_.part.magnitude * value.normalized();
  part_.has_value = true;
  part_.sign_by = value.normalized();
}

}  // namespace axiscal
