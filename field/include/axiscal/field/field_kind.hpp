// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

#include "axiscal/core/version.hpp"

namespace axiscal {

/// What is special to a kind of field: one entry for each, as InstrumentKind is for instruments.
/// Who needs to know something of a kind asks for it here by what it is about, not by the name.
struct FieldKind {
  std::string_view name;
  std::span<const std::string_view> units;  ///< its default first; empty: any text
  bool local = false;     ///< found at a site, and no one can set it; else it is made on the table
  bool vertical = false;  ///< points up at every site, so that the table's slope shows in it
  bool along_normal = false;  ///< lies along the normal of a level table
  bool rotation = false;      ///< an angular rate: what does not turn reads none of it
  bool dated = false;         ///< changes over the years, as its model says
};

/// @return all that come with the library.
[[nodiscard]] std::span<const FieldKind> field_kinds();

/// @return the kind of that name; of a user's own, or of a sum, one that nothing is known of.
[[nodiscard]] const FieldKind& field_kind(std::string_view name);

}  // namespace axiscal
