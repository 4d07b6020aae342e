// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>

#include "axiscal/field/field_kind.hpp"

namespace axiscal {

/// The units of magnetic fields.
inline constexpr std::array<std::string_view, 5> magnetic_units = {"nT", "uT", "T", "mT", "G"};

// The FieldKind entries of the built-in kinds. Each is defined next to its class.
[[nodiscard]] FieldKind gravity_entry();
[[nodiscard]] FieldKind geomagnetic_entry();
[[nodiscard]] FieldKind earth_rotation_entry();
[[nodiscard]] FieldKind turntable_entry();
[[nodiscard]] FieldKind coil_entry();
[[nodiscard]] FieldKind light_entry();
[[nodiscard]] FieldKind custom_entry();

}  // namespace axiscal
