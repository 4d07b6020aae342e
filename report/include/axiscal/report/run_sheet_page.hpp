// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// A drawing of the cube as it must lie: on the table, against the fence behind it, its three
/// visible faces named, the face on the table and the one at the fence marked.
///
/// @return an SVG element of 200 x 190 units, without scripts; its text alternative says the same.
/// @par Source
/// method.md, section 2: x to the right along the fence, y to the fence, z up.
[[nodiscard]] std::string seat_svg(const DesignPoint& point);

/// A run sheet to print: a picture and a box to tick for every step.
///
/// @param sheet  the steps in order.
/// @param title  of the page; any text.
/// @return an HTML page that needs nothing else: no script, no request; A4 and Letter.
[[nodiscard]] std::string run_sheet_page(const std::vector<RunSheetRow>& sheet,
                                         const std::string& title);

}  // namespace axiscal
