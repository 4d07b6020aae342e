// SPDX-License-Identifier: Apache-2.0
// An HTML page in one file, with its style, its script and the script's data. It does not load
// other files.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace axiscal {

struct HtmlPage {
  std::string title;                      ///< plain text; also printed at the top of each page
  std::string subtitle;                   ///< plain text
  std::string body;                       ///< HTML
  nlohmann::ordered_json cube = nullptr;  ///< result of cube_json(); null if the page shows no cube
};

std::string html_page(const HtmlPage& page);

}  // namespace axiscal
