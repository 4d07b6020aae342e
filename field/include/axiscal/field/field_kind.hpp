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

/// The properties of a kind of field, and its factory: one entry per kind, as InstrumentKind for
/// instruments. Other code asks for a property here instead of comparing names.
struct FieldKind {
  std::string_view name;
  std::span<const std::string_view> units;  ///< its default first; empty: any text
  bool local = false;     ///< found at a site, and no one can set it; else it is made on the table
  bool vertical = false;  ///< points up at every site, so that the table's slope shows in it
  bool along_normal = false;  ///< lies along the normal of a level table
  bool rotation = false;      ///< an angular rate: only rotation is read
  bool dated = false;         ///< changes over the years, as its model says
  /// The least and the greatest magnitude that the field has on the Earth [its first unit]; both 0
  /// if it may have any.
  double least_magnitude = 0.0;
  double greatest_magnitude = 0.0;
  std::span<const std::string_view> members;  ///< that files have for it alone, as "model"
  /// A field of this kind with all inputs unset; null for a kind that files cannot state.
  std::shared_ptr<ReferenceField> (*make)() = nullptr;
};

/// @return the function that FieldKind::make wants.
template <typename Field>
[[nodiscard]] constexpr auto maker_of() {
  return +[]() -> std::shared_ptr<ReferenceField> { return std::make_shared<Field>(); };
}

/// @return all kinds: those that come with the library, then those that were added.
[[nodiscard]] AXISCAL_EXPORT std::span<const FieldKind> field_kinds();

/// Adds a kind of the user's own, so that files and options can state it. Its texts must live as
/// long as the program. Call it before any field is read and while no other thread reads fields.
/// @throws DomainError  if there is a kind of that name.
AXISCAL_EXPORT void add_field_kind(const FieldKind& kind);

/// @return the kind of that name; for an unknown name or a sum, a kind without properties.
[[nodiscard]] AXISCAL_EXPORT const FieldKind& field_kind(std::string_view name);

/// True if a magnitude is possible for the kind: gravity lies between 0.99 and 1.01 g, the Earth's
/// magnetic field between 20 and 70 uT. For a kind without limits all magnitudes are possible.
/// @param magnitude  [unit].
/// @param unit       one of the kind's units.
[[nodiscard]] AXISCAL_EXPORT bool is_possible_magnitude(const FieldKind& kind,
                                                        double magnitude,
                                                        std::string_view unit);

/// @return the limits of is_possible_magnitude() in words, as "20 to 70 uT".
[[nodiscard]] AXISCAL_EXPORT std::string possible_magnitudes(const FieldKind& kind,
                                                             std::string_view unit);

/// @throws SetupError  for a kind of field that is not known; the message lists the kinds.
AXISCAL_EXPORT void check_field_kind(std::string_view kind);

/// @return the names of all kinds, for messages: "gravity, geomagnetic, ...".
[[nodiscard]] AXISCAL_EXPORT std::string list_of_field_kinds();

}  // namespace axiscal
