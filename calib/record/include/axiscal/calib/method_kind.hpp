// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "axiscal/calib/choices.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The properties of a method: one row of the table of methods.
struct MethodKind {
  Method method = Method::joint;
  std::string_view name;
  bool by_pose = false;           ///< true: the pose or the field must be given for each reading
  bool directions_known = false;  ///< true: the field's direction is given; false: it is fitted
  bool averages_pairs = false;    ///< true: fits averages of readings with opposite fence faces
  bool by_magnitude = false;      ///< true: only the magnitude of the field is known
  /// True: the readings are fitted to the field's magnitude, because the faces may be tilted.
  bool by_length = false;
  bool by_turns = false;         ///< true: integrates a gyroscope's rates between periods at rest
  bool fits_sensitivity = true;  ///< false: fits only biases
  bool is_chosen = true;         ///< true if an experiment can choose the method
  std::string_view words{};      ///< description in summaries and reports
};

/// Adds a program's own method to the table. Do not call it while other threads calibrate.
/// @param kind  the row; its `method` is ignored.
/// @return the value of Method for the new row.
/// @throws DomainError  if the name is empty or taken.
AXISCAL_EXPORT Method add_method_kind(MethodKind kind);

/// @return the row of a method.
[[nodiscard]] AXISCAL_EXPORT const MethodKind& method_kind(Method method);

/// @return the row of a record's method. If the method is nullopt (a record of other software), the
///         row has default values and an empty name.
[[nodiscard]] AXISCAL_EXPORT const MethodKind& method_kind(std::optional<Method> method);

}  // namespace axiscal
