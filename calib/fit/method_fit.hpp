// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "axiscal/calib/method_kind.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// The fit of a method that uses the pose of each reading, or its field. Each is one file and one
/// line in the table.
struct MethodFit {
  Method method = Method::joint;
  /// @param by_field  whether the readings bring their fields.
  Estimate (*fitted)(const ReadingSet& readings, bool by_field) = nullptr;
};

/// @throws DomainError  for a method without a fit by poses.
[[nodiscard]] const MethodFit& method_fit(Method method);

/// Adds a method of a program's own. Not while other threads calibrate.
/// @param kind  its name and properties; `method` is assigned.
/// @return its number.
/// @throws DomainError  if the name is taken.
Method add_method(MethodKind kind, Estimate (*fitted)(const ReadingSet& readings, bool by_field));

/// @return the stated field.
/// @throws SetupError  if the vector of a part is not known.
[[nodiscard]] TableField stated_field(const TableField& field);

[[nodiscard]] MethodFit joint_method();
[[nodiscard]] MethodFit known_method();
[[nodiscard]] MethodFit faces_method();
[[nodiscard]] MethodFit paired_method();

}  // namespace axiscal
