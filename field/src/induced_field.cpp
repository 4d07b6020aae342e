// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/induced_field.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

constexpr double mu_0 = 4e-7 * std::numbers::pi;  // CODATA differs by 1.3e-10 of it

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

InducedField::InducedField(std::string kind,
                           const Eigen::Vector3d& value_in_table,
                           std::string unit)
    : kind_(std::move(kind)), value_(value_in_table), unit_(std::move(unit)) {
  if (!value_in_table.allFinite() || !(value_in_table.norm() > 0.0)) {
    throw DomainError("InducedField: the vector must be finite and not zero");
  }
}

std::optional<CoilShape> parse_coil_shape(std::string_view name) {
  if (name == "helmholtz") {
    return CoilShape::helmholtz;
  }
  return name == "merritt" ? std::optional(CoilShape::merritt) : std::nullopt;
}

Eigen::Vector3d coil_field_in_table_T(const Coil& coil) {
  if (!(coil.turns > 0.0) || !(coil.size_m > 0.0) || !(std::abs(coil.current_A) > 0.0) ||
      !(coil.axis_in_table.norm() > 0.0)) {
    throw DomainError("coil: turns and size must be positive, current and axis not zero");
  }
  const double ampere_turns = coil.turns * coil.current_A;
  const double along = coil.shape == CoilShape::merritt ? merritt_T(ampere_turns, coil.size_m)
                                                        : helmholtz_T(ampere_turns, coil.size_m);
  return along * coil.axis_in_table.normalized();
}

Eigen::Vector3d lamps_in_table(const std::vector<Lamp>& lamps) {
  if (lamps.empty()) {
    throw DomainError("lamps: at least one is needed");
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : lamps) {
    if (!(lamp.irradiance > 0.0) || !(lamp.direction_in_table.norm() > 0.0)) {
      throw DomainError("lamp: needs a direction and a positive irradiance");
    }
    sum += lamp.irradiance * lamp.direction_in_table.normalized();
  }
  return sum;
}

}  // namespace axiscal
