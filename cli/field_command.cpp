// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/earth_rotation_field.hpp"
#include "axiscal/field/geomagnetic_field.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "axiscal/field/sun.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct FieldCommand {
  std::optional<std::string> latitude, longitude, height, date, only;
  std::optional<std::string> magnetic_model, gravity_model;
  std::string output = "-";
  bool refraction = false;
  bool json = false;
};

void add_options(OptionSet& options, FieldCommand& command) {
  options.add("--latitude", command.latitude, "DEG", "geodetic latitude, north positive");
  options.add("--longitude", command.longitude, "DEG", "longitude, east positive");
  options.add("--height", command.height, "M", "height above the WGS 84 ellipsoid [default: 0]");
  options.add("--date", command.date, "DATE", "ISO 8601 (UTC) or decimal year [default: now]");
  options.add("--only", command.only, "NAMES",
              "fields to compute: one or more of gravity,geomagnetic,earth_rotation,sun [default: "
              "all]");
  options.add("--magnetic-model", command.magnetic_model, "NAME",
              "magnetic model: wmm2025 (built in), or a model installed for GeographicLib, such as "
              "igrf14 [default: wmm2025]");
  options.add("--gravity-model", command.gravity_model, "NAME",
              "gravity model: wgs84 (built in), or a model installed for GeographicLib, such as "
              "egm96 or egm2008 [default: wgs84]");
  options.add_flag("--refraction", command.refraction,
                   "include the refraction of the air in the elevation of the sun");
  options.add_output(command.output);
  options.add_flag("--json", command.json, "print JSON instead of a table");
}

constexpr std::array<std::string_view, 4> field_names = {"gravity", "geomagnetic", "earth_rotation",
                                                         "sun"};

std::set<std::string_view> wanted_fields(const FieldCommand& command) {
  std::set<std::string_view> wanted(field_names.begin(), field_names.end());
  if (!command.only) {
    return wanted;
  }
  wanted.clear();
  for (const std::string_view name : split(*command.only, ',')) {
    const auto* const known = std::find(field_names.begin(), field_names.end(), name);
    if (known == field_names.end()) {
      throw UsageError(
          formatted("--only: unknown field '{}'{}", name,
                    did_you_mean(name, field_names,
                                 "the fields are gravity, geomagnetic, earth_rotation, sun")));
    }
    wanted.insert(*known);
  }
  return wanted;
}

Site site_of(const FieldCommand& command, const std::set<std::string_view>& wanted) {
  if (!command.latitude) {
    throw UsageError(
        "field: the site is missing: give --latitude DEG --longitude DEG [--height "
        "M]");
  }
  if (!command.longitude && (wanted.contains("geomagnetic") || wanted.contains("sun"))) {
    throw UsageError(
        "field: --longitude DEG is missing; only gravity and earth_rotation do not require the "
        "longitude (--only gravity,earth_rotation)");
  }
  return site_of_options(command.latitude, command.longitude, command.height, Site{});
}

Json geomagnetic_json(const FieldCommand& command, const Site& site, double time_s) {
  const GeomagneticModel model(command.magnetic_model.value_or("wmm2025"));
  const Eigen::Vector3d value = model.value_in_enu_nT(site, decimal_year_of(time_s));
  Json json = {{"enu", json_from(value)},
               {"magnitude", value.norm()},
               {"declination_deg", declination_of(value) * deg_per_rad},
               {"inclination_deg", inclination_of(value) * deg_per_rad},
               {"unit", "nT"},
               {"model", model.name()}};
  if (const auto u = model.uncertainty(value)) {
    json["u_enu"] = json_from(u->in_enu_nT);
    json["u_magnitude"] = u->magnitude_nT;
    json["u_declination_deg"] = u->declination_rad * deg_per_rad;
    json["u_inclination_deg"] = u->inclination_rad * deg_per_rad;
  }
  return json;
}

Json fields_json(const FieldCommand& command,
                 const std::set<std::string_view>& wanted,
                 const Site& site,
                 double time_s) {
  Json json = Json::object();
  if (wanted.contains("gravity")) {
    const std::string model = command.gravity_model.value_or("wgs84");
    const Eigen::Vector3d value = gravity_in_enu(site, model);
    json["gravity"] = {{"enu", json_from(value)},
                       {"magnitude", value.norm()},
                       {"unit", "m/s^2"},
                       {"model", model}};
  }
  if (wanted.contains("geomagnetic")) {
    json["geomagnetic"] = geomagnetic_json(command, site, time_s);
  }
  if (wanted.contains("earth_rotation")) {
    const EarthRotationField rotation(site);
    json["earth_rotation"] = {{"enu", json_from(rotation.value_in_enu())},
                              {"magnitude", rotation.magnitude()},
                              {"unit", rotation.unit()}};
  }
  if (wanted.contains("sun")) {
    const SunPosition sun = sun_position(site, time_s, command.refraction);
    json["sun"] = {{"enu", json_from(sun.direction_in_enu)},
                   {"azimuth_deg", sun.azimuth_rad * deg_per_rad},
                   {"elevation_deg", sun.elevation_rad * deg_per_rad}};
  }
  return json;
}

std::string row(const std::string& name, const Json& field, const char* format) {
  std::string text = formatted("{:<15}", name);
  for (const Json& component : field.at("enu")) {
    text += formatted_by(format, component.get<double>());
  }
  return text;
}

std::string table(const Json& json, const Site& site, double time_s) {
  std::string text = formatted(
      "latitude {}, longitude {}, height {} m above the ellipsoid, date {:.4f}\n"
      "\n"
      "{:<15}{:>15}{:>15}{:>15}{:>15}\n",
      number_text(site.latitude_deg), number_text(site.longitude_deg), number_text(site.height_m),
      decimal_year_of(time_s), "", "east", "north", "up", "magnitude");
  const auto add = [&](const char* name, const char* format) {
    if (json.contains(name)) {
      const Json& field = json.at(name);
      text += formatted("{}{}  {}", row(name, field, format),
                        formatted_by(format, field.at("magnitude").get<double>()),
                        field.at("unit").get<std::string>());
      text += field.contains("model") ? formatted(" ({})\n", field.at("model").get<std::string>())
                                      : "\n";
    }
  };
  add("gravity", "{:>15.6f}");
  add("geomagnetic", "{:>15.1f}");
  add("earth_rotation", "{:>15.6e}");
  if (json.contains("sun")) {
    text += row("sun", json.at("sun"), "{:>15.5f}") + formatted("{:>15}\n", "direction");
  }
  if (json.contains("geomagnetic")) {
    const Json& field = json.at("geomagnetic");
    text += formatted(
        "\nmagnetic declination {:.2f} degrees (+ east), inclination {:.2f} degrees (+ down)\n",
        field.at("declination_deg").get<double>(), field.at("inclination_deg").get<double>());
    if (field.contains("u_magnitude")) {
      text += formatted(
          "  standard uncertainty of the model: magnitude {:.0f} nT, declination {:.2f}, "
          "inclination {:.2f} degrees\n",
          field.at("u_magnitude").get<double>(), field.at("u_declination_deg").get<double>(),
          field.at("u_inclination_deg").get<double>());
    }
  }
  if (json.contains("sun")) {
    text += formatted("\nsun: azimuth {:.2f}, elevation {:.2f} degrees\n",
                      json.at("sun").at("azimuth_deg").get<double>(),
                      json.at("sun").at("elevation_deg").get<double>());
  }
  return text;
}

int run(const FieldCommand& command) {
  const std::set<std::string_view> wanted = wanted_fields(command);
  const Site site = site_of(command, wanted);
  const double time_s = command.date ? date_of_option(*command.date) : seconds_now();
  const Json json = fields_json(command, wanted, site, time_s);
  write_text(command.output, command.json ? json.dump(2) + "\n" : table(json, site, time_s));
  return 0;
}

}  // namespace

Subcommand field_subcommand() {
  return make_subcommand<FieldCommand>(
      "field", "compute gravity, magnetic field, rotation and sun at a site", "", &add_options,
      &run);
}

}  // namespace axiscal::cli
