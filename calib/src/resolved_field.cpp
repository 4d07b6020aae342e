// SPDX-License-Identifier: Apache-2.0
#include "resolved_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/field/earth_rotation_field.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/field/geomagnetic_field.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "axiscal/field/sun.hpp"

namespace axiscal {
namespace {

// What gravity models are off by from gravity on the ground (1 standard deviation) [m/s^2]: WGS 84
// normal gravity knows no anomalies; EGM96 and EGM2008 leave out what is smaller than their grid.
// Measured at 2872 ground stations of southern Africa (Proof in docs/fields.md).
constexpr double normal_gravity_u = 4e-4;
constexpr double gravity_model_u = 2e-4;

class Resolver {
 public:
  Resolver(const Experiment& experiment, const FieldPart& part, std::optional<double> time_s)
      : experiment_(experiment), given_(part), time_s_(time_s) {
    part_.unit = part.unit;
    part_.part.kind = part.kind;
  }

  ResolvedPart resolve() {
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

 private:
  using Make = void (Resolver::*)();
  struct Kind {
    std::string_view name;
    Make resolve;
  };
  static const std::array<Kind, 7> kinds;

  void check_given() const {
    if (given_.in_table && !(given_.in_table->norm() > 0.0 && given_.in_table->norm() < 1e150)) {
      throw SetupError("--field-table: the vector must not be zero, and shorter than 1e150");
    }
    if (given_.magnitude && !(*given_.magnitude > 0.0 && std::isfinite(*given_.magnitude))) {
      throw SetupError("--field-magnitude: must be a positive number");
    }
    if (!(given_.magnitude_u >= 0.0)) {
      throw SetupError("--field-magnitude-u: must not be negative");
    }
    if (!given_.custom) {
      const std::string& kind = given_.kind;
      refuse_unless(!given_.coil || kind == "induced_magnetic", "a coil makes induced_magnetic");
      refuse_unless(!(given_.sun || !given_.lamps.empty()) || kind == "light",
                    "lamps and the sun make light");
    }
  }

  static void refuse_unless(bool good, const std::string& what) {
    if (!good) {
      throw SetupError("field: " + what);
    }
  }

  void resolve_own() {
    const ReferenceField& own = *given_.custom;
    if (given_.magnitude && !(std::abs(*given_.magnitude / own.magnitude() - 1.0) <= 1e-9)) {
      throw SetupError("field " + std::string(own.kind()) +
                       ": a field of one's own states its "
                       "magnitude itself, " +
                       number_text(own.magnitude()) + " " + std::string(own.unit()) +
                       "; another one, " + number_text(*given_.magnitude) +
                       ", is stated beside it: leave one of them out");
    }
    part_.part.kind = own.kind();
    part_.unit = own.unit();
    part_.part.magnitude = own.magnitude();
    put_model_u(own.magnitude_uncertainty());
    part_.part.set_by_level = own.is_induced();
    put_value(own, own.is_induced());
  }

  void resolve_kind() {
    if (given_.kind.empty()) {
      throw SetupError("the field is not stated; give --field " + list_of_kinds());
    }
    check_kind(given_.kind);
    if (part_.unit.empty()) {
      const auto units = units_of_field(given_.kind);
      part_.unit = units.empty() ? "1" : units.front();
    }
    check_field_unit(given_.kind, part_.unit);
    (this->*find_kind(given_.kind)->resolve)();
  }

 public:
  static void check_kind(const std::string& name) {
    if (find_kind(name) == kinds.end()) {
      std::vector<std::string_view> names;
      for (const Kind& known : kinds) {
        names.push_back(known.name);
      }
      throw SetupError("unknown field '" + name + "'" + did_you_mean(name, names) +
                       "; this version knows: " + list_of_kinds());
    }
  }

 private:
  static auto find_kind(const std::string& name) -> const Kind* {
    return std::find_if(kinds.begin(), kinds.end(),
                        [&](const Kind& known) { return known.name == name; });
  }

  static std::string list_of_kinds() {
    std::vector<std::string> names;
    for (const Kind& known : kinds) {
      names.emplace_back(known.name);
    }
    return joined(names);
  }

  [[nodiscard]] const Site& site() const { return *experiment_.field.site; }
  [[nodiscard]] bool has_site() const { return experiment_.field.site.has_value(); }

  [[nodiscard]] double time_s() const {
    const std::string& date = experiment_.field.date;
    if (date.empty()) {
      return seconds_now();
    }
    const std::optional<double> time_s = parse_date(date);
    if (!time_s) {
      throw SetupError("--date: '" + date + "' is neither ISO 8601 nor a decimal year");
    }
    return *time_s;
  }

  // The given magnitude, else the given vector's length; nothing where neither is there.
  [[nodiscard]] std::optional<double> given_magnitude() const {
    if (given_.magnitude) {
      return given_.magnitude;
    }
    return given_.in_table ? std::optional<double>(given_.in_table->norm()) : std::nullopt;
  }

  void put_magnitude(double magnitude) {
    part_.part.magnitude = magnitude;
    part_.magnitude_u = given_.magnitude_u;
  }

  // A model's own uncertainty, unless the user states another.
  void put_model_u(double magnitude_u) {
    part_.magnitude_u = given_.magnitude_u > 0.0 ? given_.magnitude_u : magnitude_u;
  }

  // The field's value in the table, of the part's magnitude.
  void put_value(const ReferenceField& field, bool induced) {
    const Eigen::Vector3d value = field.value_in_enu();
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

  void resolve_gravity() {
    part_.part.set_by_level = false;
    const std::string model = given_.model.empty() ? "wgs84" : given_.model;
    put_magnitude(1.0);
    if (const std::optional<double> magnitude = given_magnitude()) {
      put_magnitude(*magnitude);
    } else if (part_.unit != "g") {
      if (!has_site()) {
        throw SetupError(
            "field gravity in m/s^2: its magnitude is not known; give --field-magnitude, or "
            "--latitude and --height of the site");
      }
      put_magnitude(GravityField(site(), model).magnitude());
      part_.model = model;
      put_model_u(model == "wgs84" ? normal_gravity_u : gravity_model_u);
    }
    if (part_.unit == "g" && has_site()) {
      part_.local_gravity = GravityField(site(), model).magnitude() / part_.part.magnitude;
      part_.model = model;
    }
    put_value(GravityField(part_.part.magnitude, part_.unit), false);
    part_.has_heading = true;
  }

  void require_longitude() const {
    if (!experiment_.field.has_longitude) {
      throw SetupError("field " + given_.kind + ": the site's longitude is missing (--longitude)");
    }
  }

  void resolve_geomagnetic() {
    part_.part.set_by_level = false;
    if (has_site()) {
      require_longitude();
      const GeomagneticModel model(given_.model.empty() ? "wmm2025" : given_.model);
      const GeomagneticField field(site(), decimal_year_of(time_s()), part_.unit, model);
      put_magnitude(given_magnitude().value_or(field.magnitude()));
      if (!given_magnitude()) {
        put_model_u(field.magnitude_uncertainty());
      }
      part_.model = model.name();
      put_value(field, false);
      return;
    }
    put_magnitude_or_fail("the site (--latitude, --longitude, --height)");
  }

  void resolve_earth_rotation() {
    part_.part.set_by_level = false;
    if (has_site()) {
      const EarthRotationField field(site(), part_.unit);
      put_magnitude(given_magnitude().value_or(field.magnitude()));
      put_value(field, false);
      return;
    }
    put_magnitude(
        given_magnitude().value_or(factor_between("rad/s", part_.unit) * earth_rate_rad_per_s));
  }

  void resolve_turntable() {
    part_.part.turning = true;
    put_magnitude_or_fail("the turntable's rate");
    part_.part.in_table = {0.0, 0.0, part_.part.magnitude};
    part_.has_value = true;
    part_.sign_by = Eigen::Vector3d::UnitZ();
  }

  // A field whose vector follows from what makes it; a magnitude that is given wins.
  template <typename Maker>
  void put_made(const Maker& make) {
    Eigen::Vector3d value;
    try {
      value = make();
    } catch (const DomainError& error) {
      throw SetupError("field " + given_.kind + ": " + error.what());
    }
    put_magnitude(given_magnitude().value_or(value.norm()));
    part_.part.in_table = part_.part.magnitude * value.normalized();
    part_.has_value = true;
    part_.sign_by = value.normalized();
  }

  void resolve_induced_magnetic() {
    if (given_.coil) {
      put_made([&]() -> Eigen::Vector3d {
        return factor_between("T", part_.unit) * coil_field_in_table_T(*given_.coil);
      });
      return;
    }
    if (!given_magnitude()) {
      part_.part.free_length = true;  // what else is known must fix the scale
    }
    put_magnitude(given_magnitude().value_or(1.0));
  }

  void resolve_light() {
    if (part_.unit != "1" && !given_magnitude() && given_.lamps.empty()) {
      throw SetupError("field light in " + part_.unit +
                       ": its magnitude is not known; give --field-magnitude");
    }
    put_magnitude(given_magnitude().value_or(1.0));
    if (given_.sun) {
      resolve_sun();
    } else if (!given_.lamps.empty()) {
      put_made([&]() -> Eigen::Vector3d { return lamps_in_table(given_.lamps); });
      for (const Lamp& lamp : given_.lamps) {
        part_.lamps.push_back(lamp.direction_in_table.normalized());
      }
    }
  }

  void resolve_sun() {
    if (!has_site()) {
      throw SetupError("the sun's place needs the site: --latitude and --longitude");
    }
    if (!time_s_ && experiment_.field.date.find('T') == std::string::npos) {
      return;  // the readings' times are not known yet, or there are none
    }
    require_longitude();
    const double at_s = time_s_.value_or(time_s());
    const SunPosition sun = sun_position(site(), at_s, given_.refraction);
    if (!(sun.elevation_rad > 0.0)) {
      const std::string what =
          "at the time of the readings the sun is below the horizon; check the site, and that "
          "times "
          "are in UTC";
      if (time_s_) {
        throw RefusedError(what);
      }
      throw SetupError(what);
    }
    part_.model = "sun";
    put_value(InducedField("light", sun.direction_in_enu, part_.unit), false);
  }

  void resolve_custom() {
    if (!given_magnitude() && part_.unit != "1") {
      throw SetupError("field custom in " + part_.unit +
                       ": its magnitude is not known; give --field-table or --field-magnitude");
    }
    put_magnitude(given_magnitude().value_or(1.0));
  }

  void put_magnitude_or_fail(const std::string& what) {
    if (!given_magnitude()) {
      throw SetupError("field " + given_.kind + ": its magnitude is not known; give " + what +
                       " or --field-magnitude");
    }
    put_magnitude(*given_magnitude());
  }

  const Experiment& experiment_;
  const FieldPart& given_;
  std::optional<double> time_s_;
  ResolvedPart part_;
};

const std::array<Resolver::Kind, 7> Resolver::kinds = {{
    {"gravity", &Resolver::resolve_gravity},
    {"geomagnetic", &Resolver::resolve_geomagnetic},
    {"earth_rotation", &Resolver::resolve_earth_rotation},
    {"induced_rotation", &Resolver::resolve_turntable},
    {"induced_magnetic", &Resolver::resolve_induced_magnetic},
    {"light", &Resolver::resolve_light},
    {"custom", &Resolver::resolve_custom},
}};

void convert(ResolvedPart& part, const std::string& unit) {
  double factor = 1.0;
  try {
    factor = factor_between(part.unit, unit);
  } catch (const DomainError&) {
    throw SetupError("field: its parts must be of one quantity; " + part.part.kind + " is in " +
                     part.unit + ", the first part in " + unit);
  }
  part.part.magnitude *= factor;
  part.part.in_table *= factor;
  part.magnitude_u *= factor;
  part.unit = unit;
}

}  // namespace

void check_field_kind(const std::string& kind) {
  Resolver::check_kind(kind);
}

void check_field_unit(const std::string& kind, const std::string& unit) {
  const auto units = units_of_field(kind);
  if (!units.empty() && std::find(units.begin(), units.end(), unit) == units.end()) {
    const std::vector<std::string> names(units.begin(), units.end());
    throw SetupError("field " + kind + ": the unit must be " + joined(names, " or ") + ", not '" +
                     unit + "'");
  }
}

ResolvedPart resolve_part(const Experiment& experiment,
                          const FieldPart& part,
                          std::optional<double> time_s) {
  return Resolver(experiment, part, time_s).resolve();
}

std::vector<ResolvedPart> resolve_field(const Experiment& experiment,
                                        std::optional<double> time_s) {
  const FieldSetup& setup = experiment.field;
  if (setup.site) {
    check_site(*setup.site);
  }
  if (!(experiment.slope.norm() < 1.0)) {
    throw SetupError("--slope: X^2 + Y^2 must be less than 1");
  }
  if (setup.in_table && experiment.slope.norm() > 0.0) {
    throw SetupError(
        "--slope and --field-table both say how the field lies in the table; give one of them");
  }
  std::vector<ResolvedPart> parts = {resolve_part(experiment, setup, time_s)};
  for (const FieldPart& other : setup.others) {
    parts.push_back(resolve_part(experiment, other, time_s));
    convert(parts.back(), parts.front().unit);
  }
  if (parts.size() == 1 && parts.front().part.free_length) {
    throw SetupError("field " + parts.front().part.kind +
                     ": its magnitude is not known; give --field-table, --field-magnitude or a "
                     "coil");
  }
  const bool all_free = std::all_of(parts.begin(), parts.end(),
                                    [](const ResolvedPart& part) { return part.part.free_length; });
  if (all_free) {
    throw SetupError("field: of no part the magnitude is known, so nothing fixes the scale");
  }
  const auto turning = std::count_if(parts.begin(), parts.end(),
                                     [](const ResolvedPart& part) { return part.part.turning; });
  if (turning > 1) {
    throw SetupError("field: a table turns about one axis; give one induced_rotation");
  }
  return parts;
}

FieldDescription describe_field(const Experiment& experiment,
                                const std::vector<ResolvedPart>& parts) {
  const FieldSetup& setup = experiment.field;
  FieldDescription field;
  field.unit = parts.front().unit;
  for (const ResolvedPart& part : parts) {
    field.model = field.model.empty() ? part.model : field.model;
  }
  field.local_gravity = parts.front().local_gravity;
  field.site = setup.site;
  field.date = setup.date;
  const bool dated = std::any_of(parts.begin(), parts.end(), [](const ResolvedPart& part) {
    return part.part.kind == "geomagnetic" && !part.model.empty();
  });
  if (field.date.empty() && dated) {
    field.date = timestamp_now().substr(0, 10);  // the model's field changes with it
  }
  if (parts.size() == 1) {
    const ResolvedPart& only = parts.front();
    field.kind = only.part.kind;
    field.magnitude = only.part.magnitude;
    field.magnitude_u = only.magnitude_u;
    if (only.has_value) {
      field.in_table = only.part.in_table;
    }
    return field;
  }
  bool has_value = true;
  for (const ResolvedPart& part : parts) {
    field.kind += (field.kind.empty() ? "" : "+") + part.part.kind;
    field.parts.push_back(part.part);
    field.magnitude_u = std::hypot(field.magnitude_u, part.magnitude_u);
    has_value = has_value && part.has_value;
  }
  if (has_value) {
    field.in_table = field.at_level(1.0);
    field.magnitude = field.in_table->norm();
  } else {
    field.magnitude = parts.front().part.magnitude;
  }
  return field;
}

FieldDescription make_field_description(const Experiment& experiment) {
  return describe_field(experiment, resolve_field(experiment));
}

Eigen::Vector3d field_at_level(const std::vector<FieldPartDescription>& parts,
                               const std::vector<Eigen::Vector3d>& values,
                               double level) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (parts[p].turning && level != 0.0) {
      axis = values[p].normalized();
    }
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Eigen::Vector3d value = (parts[p].set_by_level ? level : 1.0) * values[p];
    const bool averages = !axis.isZero() && !parts[p].turning;
    sum += averages ? Eigen::Vector3d(value.dot(axis) * axis) : value;
  }
  return sum;
}

Eigen::Vector3d FieldDescription::at_level(double level) const {
  if (parts.empty()) {
    return level * in_table.value_or(Eigen::Vector3d(0.0, 0.0, magnitude));
  }
  std::vector<Eigen::Vector3d> values;
  values.reserve(parts.size());
  for (const FieldPartDescription& part : parts) {
    values.push_back(part.in_table);
  }
  return field_at_level(parts, values, level);
}

}  // namespace axiscal
