// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// A drawing of the cube as it must lie: on the table, against the fence behind it, its three
/// visible faces named, the face on the table and the one at the fence marked.
///
/// @return an SVG element of 200 x 190 units, without scripts; its text alternative says the same.
/// @par Source
/// method.md, section 2: x to the right along the fence, y to the fence, z up.
[[nodiscard]] std::string seat_svg(const DesignPoint& point);

/// A run sheet to print, or to fill in on a phone: for every step a picture, a box to tick, and
/// room for its readings and the temperature; above them for serial number, operator and date.
///
/// @param sheet       the steps in order.
/// @param instrument  its axes, unit and serial number; without axes the sheet lacks cells for
///                    readings.
/// @param title       of the page; any text.
/// @return an HTML page without external files, for A4 and Letter. Its script keeps typed values in
///         the browser and makes run_sheet_csv() with the values.
[[nodiscard]] std::string run_sheet_page(const std::vector<RunSheetRow>& sheet,
                                         const Instrument& instrument,
                                         const std::string& title);

}  // namespace axiscal
