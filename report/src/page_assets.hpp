// SPDX-License-Identifier: Apache-2.0
// What the build puts into the program; the sources are made by CMake.
#pragma once

#include <string_view>

namespace axiscal {

std::string_view report_style();      ///< report.css
std::string_view seat_style();        ///< seat.css
std::string_view run_sheet_style();   ///< run_sheet.css
std::string_view run_sheet_script();  ///< run_sheet.js, as it is
std::string_view plot_style();        ///< uPlot's; empty without the script
std::string_view report_script();     ///< bundled by esbuild; empty where this build has none

}  // namespace axiscal
