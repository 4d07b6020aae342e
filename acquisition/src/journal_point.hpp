// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/positioner/design_point.hpp"
#include "core/json_document.hpp"

namespace axiscal {

/// Puts a design point into an entry of a journal: its members `rest` and `fence`.
void put_point(Json& entry, const DesignPoint& point);

/// @throws DataError  if an entry's `rest` and `fence` are not faces, or lie on one axis.
[[nodiscard]] DesignPoint point_of(const JsonValue& entry);

}  // namespace axiscal
