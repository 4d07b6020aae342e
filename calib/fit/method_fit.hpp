// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "axiscal/calib/method_kind.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// A method that uses the pose or the field of each reading, with the function that fits the
/// readings. Each built-in method has one entry in method_fit.cpp.
struct MethodFit {
  Method method = Method::joint;
  /// @param by_field  true if each reading has its own given field.
  Estimate (*fitted)(const ReadingSet& readings, bool by_field) = nullptr;
};

/// @throws DomainError  if the method does not fit readings by their poses.
[[nodiscard]] const MethodFit& method_fit(Method method);

/// Adds a user-defined method. No other thread may calibrate during the call.
/// @param kind  the name and properties of the method; the call sets kind.method.
/// @return the enumerator of the new method.
/// @throws DomainError  if the name is taken.
Method add_method(MethodKind kind, Estimate (*fitted)(const ReadingSet& readings, bool by_field));

/// @return a copy of the field in which each part has its stated vector.
/// @throws SetupError  if the vector of a part is not stated.
[[nodiscard]] TableField stated_field(const TableField& field);

[[nodiscard]] MethodFit joint_method();
[[nodiscard]] MethodFit known_method();
[[nodiscard]] MethodFit faces_method();
[[nodiscard]] MethodFit paired_method();

}  // namespace axiscal
