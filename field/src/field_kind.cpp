// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_kind.hpp"

#include <algorithm>
#include <array>

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 2> of_gravity = {"g", "m/s^2"};
constexpr std::array<std::string_view, 5> of_magnetism = {"nT", "uT", "T", "mT", "G"};
constexpr std::array<std::string_view, 3> of_rotation = {"rad/s", "deg/s", "deg/h"};
constexpr std::array<std::string_view, 3> of_turntable = {"deg/s", "rad/s", "deg/h"};
constexpr std::array<std::string_view, 2> of_light = {"1", "W/m^2"};

constexpr std::array kinds = {
    FieldKind{.name = "gravity",
              .units = of_gravity,
              .local = true,
              .vertical = true,
              .along_normal = true},
    FieldKind{.name = "geomagnetic", .units = of_magnetism, .local = true, .dated = true},
    FieldKind{.name = "earth_rotation", .units = of_rotation, .local = true, .rotation = true},
    FieldKind{
        .name = "induced_rotation", .units = of_turntable, .along_normal = true, .rotation = true},
    FieldKind{.name = "induced_magnetic", .units = of_magnetism},
    FieldKind{.name = "light", .units = of_light},
    FieldKind{.name = "custom"},
};

constexpr FieldKind another = {};

}  // namespace

std::span<const FieldKind> field_kinds() {
  return kinds;
}

const FieldKind& field_kind(std::string_view name) {
  const auto* const found = std::find_if(kinds.begin(), kinds.end(),
                                         [&](const FieldKind& kind) { return kind.name == name; });
  return found == kinds.end() ? another : *found;
}

}  // namespace axiscal
