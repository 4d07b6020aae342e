// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/positioner/design_point.hpp"
#include "core/json_document.hpp"

namespace axiscal {

/// Sets the members `rest` and `fence` of a journal entry to a design point.
void put_point(Json& entry, const DesignPoint& point);

/// @return the design point in the members `rest` and `fence` of a journal entry.
/// @throws DataError  if a member is not a face, or both faces are on the same axis.
[[nodiscard]] DesignPoint point_of(const JsonValue& entry);

}  // namespace axiscal
