// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "axiscal/calib/choices.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The properties of a method that do not depend on the data: one row for each method. Code that
/// needs such a property reads it here.
struct MethodKind {
  Method method = Method::joint;
  std::string_view name;
  bool by_pose = false;           ///< needs to know how the instrument lay, or the field there
  bool directions_known = false;  ///< the field's directions are given; else they are fitted
  bool averages_pairs = false;    ///< regresses on averages of opposite readings
  bool by_magnitude = false;      ///< only the field's magnitude is known
  bool by_length = false;         ///< of faces that may lean, whose directions find mistakes alone
  bool by_turns = false;          ///< a gyroscope's attitudes from rest to rest
  bool fits_sensitivity = true;   ///< else biases alone
  bool is_chosen = true;          ///< an experiment can choose it
  std::string_view words{};       ///< the quantity on which it regresses
};

/// Adds a method of a program's own to the table. Not while other threads calibrate.
/// @param kind  `method` is assigned.
/// @return its number.
/// @throws DomainError  if the name is empty or taken.
AXISCAL_EXPORT Method add_method_kind(MethodKind kind);

/// @return the row of a method.
[[nodiscard]] AXISCAL_EXPORT const MethodKind& method_kind(Method method);

/// @return the row of a record's method; where another software did it, of none: all is false.
[[nodiscard]] AXISCAL_EXPORT const MethodKind& method_kind(std::optional<Method> method);

}  // namespace axiscal
