// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "axiscal/instruments/inclination.hpp"

namespace axiscal {

/// What a kind of instrument derives from the field: at most four numbers, NaN for an empty one.
struct DerivedValues {
  std::array<double, 4> values{};
  bool clamped = false;
};

/// A kind of instrument is data: its name and what its users want to know of the field.
///
/// A new kind is one more entry in the table of instrument_kind.cpp.
struct InstrumentKind {
  std::string_view name;
  std::span<const std::string_view> derived_names;  ///< columns, e.g. "pitch_deg"

  /// Gives as many values as there are derived_names from the field's components [field unit] and
  /// its magnitude [field unit]; null where nothing is derived.
  DerivedValues (*derive)(const Eigen::Vector3d& field_in_sensor,
                          double magnitude,
                          const InclinationOptions& options) noexcept;

  bool has_axis_elevation = false;  ///< with fewer than three axes: angle above the horizontal
};

/// @return all kinds that this version knows.
[[nodiscard]] std::span<const InstrumentKind> instrument_kinds();

/// @return the kind of that name.
/// @throws DomainError  if there is none; the message lists the names.
[[nodiscard]] const InstrumentKind& find_instrument_kind(std::string_view name);

}  // namespace axiscal
