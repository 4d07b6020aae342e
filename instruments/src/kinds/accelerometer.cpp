// SPDX-License-Identifier: Apache-2.0

#include "axiscal/core/not_a_number.hpp"
#include "instruments/src/kinds/kinds.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 3> names = {"pitch_deg", "roll_deg", "yaw_deg"};

DerivedValues derive(const DeriveInput& input) noexcept {
  const Inclination angles =
      inclination_from_field(input.field_in_sensor, input.magnitude, input.inclination);
  return {.values = {angles.pitch_rad * deg_per_rad,
                     angles.gives_yaw ? not_a_number : angles.roll_rad * deg_per_rad,
                     angles.gives_yaw ? angles.yaw_rad * deg_per_rad : not_a_number},
          .clamped = angles.clamped};
}

}  // namespace

InstrumentKind accelerometer_kind() {
  return {.name = "accelerometer",
          .derived_names = names,
          .derive = derive,
          .has_axis_elevation = true,
          .usual_field = "gravity",
          .sensor = VehicleSensor::accelerometer,
          .columns = {.letters = "a", .word = "acc"}};
}

InstrumentKind inclinometer_kind() {
  InstrumentKind kind = accelerometer_kind();
  kind.name = "inclinometer";
  return kind;
}

}  // namespace axiscal
