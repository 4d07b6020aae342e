// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/instrument_kind.hpp"

#include <limits>
#include <string>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 3> inclination_names = {"pitch_deg", "roll_deg", "yaw_deg"};

DerivedValues derive_inclination(const Eigen::Vector3d& field_in_sensor,
                                 double magnitude,
                                 const InclinationOptions& options) noexcept {
  const Inclination angles = inclination_from_field(field_in_sensor, magnitude, options);
  constexpr double empty = std::numeric_limits<double>::quiet_NaN();
  return {.values = {angles.pitch_rad * deg_per_rad,
                     angles.gives_yaw ? empty : angles.roll_rad * deg_per_rad,
                     angles.gives_yaw ? angles.yaw_rad * deg_per_rad : empty},
          .clamped = angles.clamped};
}

constexpr std::array kinds = {
    InstrumentKind{.name = "accelerometer",
                   .derived_names = inclination_names,
                   .derive = derive_inclination,
                   .has_axis_elevation = true},
    InstrumentKind{.name = "inclinometer",
                   .derived_names = inclination_names,
                   .derive = derive_inclination,
                   .has_axis_elevation = true},
    InstrumentKind{.name = "generic", .derived_names = {}, .derive = nullptr},
};

}  // namespace

std::span<const InstrumentKind> instrument_kinds() {
  return kinds;
}

const InstrumentKind& find_instrument_kind(std::string_view name) {
  std::string known;
  for (const InstrumentKind& kind : kinds) {
    if (kind.name == name) {
      return kind;
    }
    known += (known.empty() ? "" : ", ") + std::string(kind.name);
  }
  throw DomainError("unknown kind of instrument '" + std::string(name) +
                    "'; this version knows: " + known);
}

}  // namespace axiscal
