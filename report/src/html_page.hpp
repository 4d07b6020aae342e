// SPDX-License-Identifier: Apache-2.0
// A page around its content: one file that asks for nothing, with its style, its script and what
// the script draws.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace axiscal {

struct HtmlPage {
  std::string title;                      ///< as it is to be read; also on each printed page
  std::string subtitle;                   ///< as it is to be read
  std::string body;                       ///< of pieces that are escaped
  nlohmann::ordered_json plots;           ///< Figures::json()
  nlohmann::ordered_json cube = nullptr;  ///< cube_json(); null without one
};

std::string html_page(const HtmlPage& page);

}  // namespace axiscal
