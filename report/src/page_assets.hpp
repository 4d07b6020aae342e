// SPDX-License-Identifier: Apache-2.0
// Files that are embedded in the program. CMake generates the sources.
#pragma once

#include <string_view>

namespace axiscal {

std::string_view report_style();      ///< report.css
std::string_view seat_style();        ///< seat.css
std::string_view run_sheet_style();   ///< run_sheet.css
std::string_view run_sheet_script();  ///< run_sheet.js
std::string_view report_script();     ///< report.js and the modules that it imports

}  // namespace axiscal
