// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/method_fit.hpp"

#include <algorithm>
#include <deque>

#include "axiscal/core/error.hpp"
#include "axiscal/field/settings.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

std::deque<MethodFit>& all_fits() {
  static std::deque<MethodFit> fits = {joint_method(), known_method(), faces_method(),
                                       paired_method()};
  return fits;
}

}  // namespace

const MethodFit& method_fit(Method method) {
  const std::deque<MethodFit>& fits = all_fits();
  const auto found = std::find_if(fits.begin(), fits.end(),
                                  [&](const MethodFit& fit) { return fit.method == method; });
  if (found == fits.end()) {
    throw DomainError(
        formatted("the method '{}' cannot fit readings with design points", method_name(method)));
  }
  return *found;
}

Method add_method(MethodKind kind, Estimate (*fitted)(const ReadingSet& readings, bool by_field)) {
  const Method method = add_method_kind(kind);
  all_fits().push_back({.method = method, .fitted = fitted});
  return method;
}

TableField stated_field(const TableField& field) {
  for (const FieldDescription& part : field.parts()) {
    if (!part.in_table || part.free_length) {
      throw SetupError(
          formatted(
              "field {}: the field's vector in the table's frame ('in_table') is missing; add it",
              part.kind),
          {settings::field_table});
    }
  }
  return field.as_stated();
}

}  // namespace axiscal
