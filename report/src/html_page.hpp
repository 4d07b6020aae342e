// SPDX-License-Identifier: Apache-2.0
// A page around its content: one file with its style, its script and the script's data. It asks for
// no other file.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace axiscal {

struct HtmlPage {
  std::string title;                      ///< as it is to be read; also on each printed page
  std::string subtitle;                   ///< as it is to be read
  std::string body;                       ///< of pieces that are escaped
  nlohmann::ordered_json cube = nullptr;  ///< cube_json(); null without one
};

std::string html_page(const HtmlPage& page);

}  // namespace axiscal
