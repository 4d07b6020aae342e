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
  bool by_pose = false;           ///< each reading must state its pose or its field in the sensor
  bool directions_known = false;  ///< the field's directions are given; else they are fitted
  bool averages_pairs = false;    ///< fits averages of readings with opposite fence faces
  bool by_magnitude = false;      ///< only the field's magnitude is known
  bool by_length = false;         ///< fits the field's magnitude, on faces that may lean
  bool by_turns = false;          ///< integrates a gyroscope's rates from rest to rest
  bool fits_sensitivity = true;   ///< false: fits only biases
  bool is_chosen = true;          ///< true if an experiment can choose the method
  std::string_view words{};       ///< description in summaries and reports
};

/// Adds a program's own method to the table. Do not call it while other threads calibrate.
/// @param kind  the row; its `method` is ignored.
/// @return the value of Method for the new row.
/// @throws DomainError  if the name is empty or taken.
AXISCAL_EXPORT Method add_method_kind(MethodKind kind);

/// @return the row of a method.
[[nodiscard]] AXISCAL_EXPORT const MethodKind& method_kind(Method method);

/// @return the row of a record's method. For nullopt (a record of other software), a row with
///         default values and an empty name.
[[nodiscard]] AXISCAL_EXPORT const MethodKind& method_kind(std::optional<Method> method);

}  // namespace axiscal
