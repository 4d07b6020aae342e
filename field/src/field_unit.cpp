// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_unit.hpp"

#include <array>

#include "axiscal/core/error.hpp"
#include "axiscal/core/units.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

struct Unit {
  std::string_view name;
  std::string_view quantity;
  double in_si;
};

constexpr std::array units = {
    Unit{"m/s^2", "acceleration", 1.0},         Unit{"T", "magnetic flux density", 1.0},
    Unit{"mT", "magnetic flux density", 1e-3},  Unit{"uT", "magnetic flux density", 1e-6},
    Unit{"nT", "magnetic flux density", 1e-9},  Unit{"G", "magnetic flux density", 1e-4},
    Unit{"mG", "magnetic flux density", 1e-7},  Unit{"rad/s", "angular rate", 1.0},
    Unit{"deg/s", "angular rate", rad_per_deg}, Unit{"deg/h", "angular rate", rad_per_deg / 3600.0},
    Unit{"W/m^2", "irradiance", 1.0},           Unit{"lux", "illuminance", 1.0},
};

// Units that only readings may have, and other spellings of units. Here `g` is standard gravity.
constexpr std::array reading_units = {
    Unit{"g", "acceleration", standard_gravity},
    Unit{"mg", "acceleration", 1e-3 * standard_gravity},
    Unit{"gauss", "magnetic flux density", 1e-4},
    Unit{"Gauss", "magnetic flux density", 1e-4},
    Unit{"\u00b5T", "magnetic flux density", 1e-6},  // micro sign
    Unit{"\u03bcT", "magnetic flux density", 1e-6},  // Greek mu
    Unit{"mgauss", "magnetic flux density", 1e-7},
    Unit{"mrad/s", "angular rate", 1e-3},
    Unit{"mdeg/s", "angular rate", 1e-3 * rad_per_deg},
    Unit{"V", "voltage", 1.0},
    Unit{"mV", "voltage", 1e-3},
    Unit{"uV", "voltage", 1e-6},
};

const Unit* find_unit(std::string_view name) {
  for (const Unit& unit : units) {
    if (unit.name == name) {
      return &unit;
    }
  }
  return nullptr;
}

const Unit* find_reading_unit(std::string_view name) {
  for (const Unit& unit : reading_units) {
    if (unit.name == name) {
      return &unit;
    }
  }
  return find_unit(name);
}

}  // namespace

double factor_between(std::string_view from, std::string_view to) {
  if (from == to) {
    return 1.0;
  }
  const Unit* const a = find_unit(from);
  const Unit* const b = find_unit(to);
  if (a == nullptr || b == nullptr || a->quantity != b->quantity) {
    throw DomainError(formatted("the unit '{}' cannot be converted to '{}'", from, to));
  }
  return a->in_si / b->in_si;
}

std::optional<double> reading_factor_between(std::string_view from, std::string_view to) {
  if (from == to) {
    return 1.0;
  }
  const Unit* const a = find_reading_unit(from);
  const Unit* const b = find_reading_unit(to);
  if (a == nullptr || b == nullptr || a->quantity != b->quantity) {
    return {};
  }
  return a->in_si / b->in_si;
}

bool is_reading_unit(std::string_view name) {
  return find_reading_unit(name) != nullptr;
}

}  // namespace axiscal
