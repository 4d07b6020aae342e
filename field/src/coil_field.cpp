// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/coil_field.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/field_unit.hpp"
#include "core/json_members.hpp"
#include "field/src/field_entries.hpp"

namespace axiscal {
namespace {

constexpr double mu_0 = 4e-7 * std::numbers::pi;  // [T m/A]; CODATA 2022 within 1.3e-10 (relative)

double helmholtz_T(double ampere_turns, double radius_m) {
  return std::pow(0.8, 1.5) * mu_0 * ampere_turns / radius_m;
}

double square_loop_T(double ampere_turns, double half_side_m, double distance_m) {
  const double a2 = half_side_m * half_side_m;
  const double z2 = distance_m * distance_m;
  return 2.0 * mu_0 * ampere_turns * a2 / (std::numbers::pi * (a2 + z2) * std::sqrt(2.0 * a2 + z2));
}

double merritt_T(double ampere_turns, double side_m) {
  const double a = 0.5 * side_m;
  return 2.0 * (square_loop_T(ampere_turns, a, 0.505492 * side_m) +
                square_loop_T(ampere_turns * 11.0 / 26.0, a, 0.128106 * side_m));
}

}  // namespace

std::optional<CoilShape> parse_coil_shape(std::string_view name) {
  if (name == "helmholtz") {
    return CoilShape::helmholtz;
  }
  return name == "merritt" ? std::optional(CoilShape::merritt) : std::nullopt;
}

Eigen::Vector3d coil_field_in_table_T(const Coil& coil) {
  if (!(coil.turns > 0.0) || !(coil.size_m > 0.0) || !(std::abs(coil.current_A) > 0.0) ||
      !(coil.axis_in_table.norm() > 0.0)) {
    throw DomainError(
        "coil: turns and size must be positive, and current and axis must not be "
        "zero");
  }
  const double ampere_turns = coil.turns * coil.current_A;
  const double along = coil.shape == CoilShape::merritt ? merritt_T(ampere_turns, coil.size_m)
                                                        : helmholtz_T(ampere_turns, coil.size_m);
  return along * coil.axis_in_table.normalized();
}

CoilField::CoilField(const Coil& coil, std::string unit) : coil_(coil), unit_(std::move(unit)) {
  static_cast<void>(coil_field_in_table_T(coil));
}

Eigen::Vector3d CoilField::value_in_enu() const {
  if (!coil_) {
    return Eigen::Vector3d::Zero();
  }
  return factor_between("T", unit_.empty() ? "nT" : unit_) * coil_field_in_table_T(*coil_);
}

void CoilField::state(FieldSetup& setup) const {
  setup.unit = unit_;
}

void CoilField::resolve(FieldResolver& of) const {
  if (coil_) {
    of.set_made([&]() -> Eigen::Vector3d {
      return factor_between("T", of.found().unit) * coil_field_in_table_T(*coil_);
    });
  } else if (of.given_magnitude()) {
    of.set_magnitude(*of.given_magnitude());
  } else if (of.largest_field_length()) {
    of.set_magnitude(*of.largest_field_length());
  } else {
    of.mark_magnitude_unknown();  // another part must have a known magnitude
  }
}

void CoilField::members(JsonMembers& io) {
  static constexpr std::array<std::string_view, 5> keys = {"shape", "turns", "current_A", "size_m",
                                                           "axis_in_table"};
  io.object_if_any("coil", coil_, [](JsonMembers& one, Coil& coil) {
    one.allow_keys(keys);
    one.choice(
        "shape", coil.shape,
        [](CoilShape shape) { return shape == CoilShape::merritt ? "merritt" : "helmholtz"; },
        parse_coil_shape, "helmholtz, merritt");
    one.need("turns", coil.turns);
    one.need("current_A", coil.current_A);
    one.need("size_m", coil.size_m);
    if (one.has("axis_in_table", true)) {
      one.need_vector("axis_in_table", coil.axis_in_table, 3);
    }
  });
  if (coil_) {
    io.check("coil", [&] { static_cast<void>(coil_field_in_table_T(*coil_)); });
  }
}

FieldKind coil_entry() {
  static constexpr std::array<std::string_view, 1> members = {"coil"};
  return {.name = "induced_magnetic",
          .units = magnetic_units,
          .members = members,
          .make = maker_of<CoilField>()};
}

}  // namespace axiscal
