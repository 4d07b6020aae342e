// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// Draws the cube in a pose, on the table and against the fence behind it. The three visible faces
/// are labelled with their names. The face on the table and the face at the fence are marked.
///
/// @return an SVG element of 200 x 190 units, without scripts, with a text alternative.
/// @par Source
/// method.md, section 2: x is to the right along the fence, y towards the fence, z up.
[[nodiscard]] std::string seat_svg(const DesignPoint& point);

/// Writes a run sheet to print, or to fill in on a phone. It has fields for serial number, operator
/// and date. Each step has a drawing, a box to tick, and fields for the readings and the
/// temperature.
///
/// @param sheet       the steps in order.
/// @param instrument  instrument whose axes, unit and serial number the sheet shows; if it has no
///                    axes, the sheet has no fields for readings.
/// @param title       title of the page; any text.
/// @return an HTML page for A4 and Letter that loads no other files. Its script stores typed values
///         in the browser, and saves them as a file in the format of run_sheet_csv().
[[nodiscard]] std::string run_sheet_page(const std::vector<RunSheetRow>& sheet,
                                         const Instrument& instrument,
                                         const std::string& title);

}  // namespace axiscal
