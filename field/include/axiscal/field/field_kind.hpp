// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// The properties of a kind of field, and its factory. There is one entry for each kind. Other code
/// uses these properties instead of comparing names.
struct FieldKind {
  std::string_view name;
  std::span<const std::string_view> units;  ///< allowed units, the default first; empty: any unit
  bool local = false;         ///< true if the field exists at a site and cannot be set
  bool vertical = false;      ///< true if the field points up; a fit then finds the table's slope
  bool along_normal = false;  ///< true if the field is parallel to the normal of a level table
  bool rotation = false;      ///< true if the field is an angular rate
  bool dated = false;         ///< true if the field's model depends on the date
  /// Smallest and greatest magnitude of the field on the Earth, in the first of `units`. If both
  /// are 0, any magnitude is possible.
  double least_magnitude = 0.0;
  double greatest_magnitude = 0.0;
  /// JSON members that a field of this kind may have in addition to the members that every field
  /// may have, e.g. "model".
  std::span<const std::string_view> members;
  /// Function that creates a default field of this kind; null if files cannot state this kind.
  std::shared_ptr<ReferenceField> (*make)() = nullptr;
};

/// @return a function that makes a `Field`, for FieldKind::make.
template <typename Field>
[[nodiscard]] constexpr auto maker_of() {
  return +[]() -> std::shared_ptr<ReferenceField> { return std::make_shared<Field>(); };
}

/// @return all kinds: those that come with the library, then those that were added.
[[nodiscard]] AXISCAL_EXPORT std::span<const FieldKind> field_kinds();

/// Adds a kind of the user's own, so that files and options can state it. The strings of `kind`
/// must exist until the program ends. Call this function before any field is read and while no
/// other thread reads fields.
/// @throws DomainError  if the name is empty or already exists.
AXISCAL_EXPORT void add_field_kind(const FieldKind& kind);

/// @return the kind of that name; for an unknown name or a sum, a kind without properties.
[[nodiscard]] AXISCAL_EXPORT const FieldKind& field_kind(std::string_view name);

/// Returns true if a magnitude is within the limits of the kind: 0.99 to 1.01 g for gravity, 20 to
/// 70 uT for the Earth's magnetic field. Other kinds have no limits.
/// @param magnitude  the magnitude [unit].
/// @param unit       one of the kind's units.
[[nodiscard]] AXISCAL_EXPORT bool is_possible_magnitude(const FieldKind& kind,
                                                        double magnitude,
                                                        std::string_view unit);

/// @return the limits of is_possible_magnitude() as text, e.g. "20 to 70 uT".
[[nodiscard]] AXISCAL_EXPORT std::string possible_magnitudes(const FieldKind& kind,
                                                             std::string_view unit);

/// @throws SetupError  if the kind is unknown; the message lists the kinds.
AXISCAL_EXPORT void check_field_kind(std::string_view kind);

/// @return the names of all kinds, for messages: "gravity, geomagnetic, ...".
[[nodiscard]] AXISCAL_EXPORT std::string list_of_field_kinds();

}  // namespace axiscal
