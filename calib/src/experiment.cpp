// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/experiment.hpp"

#include <array>
#include <cmath>

#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/custom_field.hpp"
#include "axiscal/field/gravity_field.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 3> method_names = {"paired", "joint", "known"};
constexpr std::array<std::string_view, 3> weighting_names = {"none", "samples", "sd"};
constexpr std::array<std::string_view, 2> level_by_names = {"run", "block"};
constexpr std::array<std::string_view, 2> field_kinds = {"gravity", "custom"};

template <typename Enum, std::size_t Size>
std::optional<Enum> find_in(const std::array<std::string_view, Size>& names,
                            std::string_view name) {
  for (std::size_t i = 0; i < Size; ++i) {
    if (names[i] == name) {
      return static_cast<Enum>(i);
    }
  }
  return std::nullopt;
}

std::shared_ptr<const ReferenceField> make_gravity(const FieldSetup& setup) {
  const std::string unit = setup.unit.empty() ? "g" : setup.unit;
  if (unit != "g" && unit != "m/s^2") {
    throw SetupError("field gravity: the unit must be g or m/s^2, not '" + unit + "'");
  }
  if (setup.magnitude) {
    return std::make_shared<GravityField>(*setup.magnitude, unit);
  }
  if (setup.in_table) {
    return std::make_shared<GravityField>(setup.in_table->norm(), unit);
  }
  if (unit == "g") {
    return std::make_shared<GravityField>();
  }
  if (!setup.site) {
    throw SetupError(
        "field gravity in m/s^2: its magnitude is not known; give --field-magnitude, or "
        "--latitude and --height of the site");
  }
  return std::make_shared<GravityField>(*setup.site);
}

// Its direction counts only where in_table is not given, which make_field_description() sees to.
std::shared_ptr<const ReferenceField> make_custom(const FieldSetup& setup) {
  const std::string unit = setup.unit.empty() ? "1" : setup.unit;
  const double magnitude = setup.magnitude  ? *setup.magnitude
                           : setup.in_table ? setup.in_table->norm()
                                            : 1.0;
  if (!setup.magnitude && !setup.in_table && unit != "1") {
    throw SetupError("field custom in " + unit +
                     ": its magnitude is not known; give --field-table or --field-magnitude");
  }
  return std::make_shared<CustomField>(Eigen::Vector3d(0.0, 0.0, magnitude), unit);
}

std::shared_ptr<const ReferenceField> make_field(const FieldSetup& setup) {
  if (setup.custom) {
    return setup.custom;
  }
  if (setup.kind == "gravity") {
    return make_gravity(setup);
  }
  if (setup.kind == "custom") {
    return make_custom(setup);
  }
  if (setup.kind.empty()) {
    throw SetupError("the field is not stated; give --field gravity or --field custom");
  }
  throw SetupError("unknown field '" + setup.kind + "'" + did_you_mean(setup.kind, field_kinds) +
                   "; this version knows: gravity, custom");
}

}  // namespace

std::string_view method_name(Method method) {
  return method_names[static_cast<std::size_t>(method)];
}

std::optional<Method> parse_method(std::string_view name) {
  return find_in<Method>(method_names, name);
}

std::string_view weighting_name(Weighting weighting) {
  return weighting_names[static_cast<std::size_t>(weighting)];
}

std::optional<Weighting> parse_weighting(std::string_view name) {
  return find_in<Weighting>(weighting_names, name);
}

std::optional<LevelBy> parse_level_by(std::string_view name) {
  return find_in<LevelBy>(level_by_names, name);
}

FieldDescription make_field_description(const Experiment& experiment) {
  const FieldSetup& setup = experiment.field;
  if (setup.site) {
    check_site(*setup.site);
  }
  if (setup.in_table && !(setup.in_table->norm() > 0.0 && setup.in_table->norm() < 1e150)) {
    throw SetupError("--field-table: the vector must not be zero, and shorter than 1e150");
  }
  if (setup.magnitude && !(*setup.magnitude > 0.0 && std::isfinite(*setup.magnitude))) {
    throw SetupError("--field-magnitude: must be a positive number");
  }
  if (!(experiment.slope.norm() < 1.0)) {
    throw SetupError("--slope: X^2 + Y^2 must be less than 1");
  }
  if (setup.in_table && experiment.slope.norm() > 0.0) {
    throw SetupError(
        "--slope and --field-table both say how the field lies in the table; give one of them");
  }
  const std::shared_ptr<const ReferenceField> field = make_field(setup);
  FieldDescription description{.kind = std::string(field->kind()),
                               .unit = std::string(field->unit()),
                               .magnitude = field->magnitude(),
                               .site = setup.site,
                               .date = setup.date};
  if (setup.in_table) {
    description.in_table = setup.in_table;
  } else if (setup.custom || setup.kind != "custom") {
    description.in_table = rotation_sloping_from_level(experiment.slope) *
                           rotation_table_from_enu(experiment.fence_azimuth_rad) *
                           field->value_in_enu();
  }
  return description;
}

}  // namespace axiscal
