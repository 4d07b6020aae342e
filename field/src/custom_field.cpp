// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/custom_field.hpp"

#include <array>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/settings.hpp"
#include "core/formatted.hpp"
#include "core/json_members.hpp"
#include "field/src/field_entries.hpp"

namespace axiscal {

CustomField::CustomField(const Eigen::Vector3d& value_in_enu, std::string unit)
    : value_in_enu_(value_in_enu), unit_(std::move(unit)) {
  if (!value_in_enu.allFinite() || !(value_in_enu.norm() > 0.0)) {
    throw DomainError("CustomField: the vector must be finite and not zero");
  }
}

void CustomField::state(FieldSetup& setup) const {
  if (has_value()) {
    setup.unit = unit_;
  }
}

void CustomField::resolve(FieldResolver& of) const {
  if (has_value()) {
    of.set_magnitude(of.given_magnitude().value_or(value_in_enu_.norm()));
    of.set_direction(value_in_enu_, false);
  } else {
    of.set_given_magnitude_or_1(
        formatted(
            " in {}: its magnitude is unknown; give the magnitude, or the vector in the table's "
            "frame",
            of.found().unit),
        {settings::field_table});
  }
}

void CustomField::members(JsonMembers& io) {
  if (io.has("in_enu", has_value())) {
    io.need_vector("in_enu", value_in_enu_, 3);
    io.check("in_enu", has_value(), "must not be zero");
  }
}

FieldKind custom_entry() {
  static constexpr std::array<std::string_view, 1> members = {"in_enu"};
  return {.name = "custom", .units = {}, .members = members, .make = maker_of<CustomField>()};
}

}  // namespace axiscal
