// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/turntable_field.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "core/formatted.hpp"
#include "field/src/field_entries.hpp"

namespace axiscal {

TurntableField::TurntableField(double rate, std::string unit)
    : rate_(rate), unit_(std::move(unit)) {
  if (!(rate > 0.0) || !std::isfinite(rate)) {
    throw DomainError("TurntableField: the rate must be positive and finite");
  }
}

void TurntableField::state(FieldSetup& setup) const {
  setup.unit = unit_;
  if (rate_ > 0.0) {
    setup.magnitude = rate_;
  }
}

void TurntableField::resolve(FieldResolver& of) const {
  if (of.given().role == FieldRole::local) {
    throw SetupError(formatted(
        "field {}: its role must be 'induced', because the turntable produces this field", kind()));
  }
  FieldDescription& found = of.found();
  found.turning = true;
  of.set_given_magnitude(
      ": the rate of the turntable is unknown. Give the rate as the field's magnitude, or give it "
      "for each reading, in the columns 'rate' and 'axis' or in the columns 'fx', 'fy', 'fz'",
      {});
  found.in_table = Eigen::Vector3d(0.0, 0.0, found.magnitude);
  found.start.sign_by = Eigen::Vector3d::UnitZ();
}

FieldKind turntable_entry() {
  static constexpr std::array<std::string_view, 3> units = {"deg/s", "rad/s", "deg/h"};
  return {.name = "induced_rotation",
          .units = units,
          .along_normal = true,
          .rotation = true,
          .members = {},
          .make = maker_of<TurntableField>()};
}

}  // namespace axiscal
