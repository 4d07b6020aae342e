// SPDX-License-Identifier: Apache-2.0
#include "html.hpp"

#include <cmath>

#include "axiscal/core/number_text.hpp"

namespace axiscal {

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

Cell number_cell(double value, int digits) {
  if (!std::isfinite(value)) {
    return {"\u2013", ""};
  }
  std::string text = number_text(value, digits);
  if (text.front() == '-') {
    text.replace(0, 1, "\u2212");
  }
  return {text, number_text(value)};
}

std::string html_table(std::string_view caption,
                       const std::vector<std::string>& head,
                       const std::vector<std::vector<Cell>>& rows) {
  std::string html = "<table data-copy>";
  if (!caption.empty()) {
    html += "<caption>" + escaped(caption) + "</caption>";
  }
  html += "<thead><tr>";
  for (const std::string& name : head) {
    html += "<th scope=\"col\">" + escaped(name) + "</th>";
  }
  html += "</tr></thead><tbody>";
  for (const std::vector<Cell>& row : rows) {
    html += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string tag = i == 0 ? "th" : "td";
      html += "<" + tag + (i == 0 ? " scope=\"row\"" : "");
      if (!row[i].value.empty() && row[i].value != row[i].text) {
        html += " data-value=\"" + escaped(row[i].value) + "\"";
      }
      html += ">" + escaped(row[i].text) + "</" + tag + ">";
    }
    html += "</tr>";
  }
  return html + "</tbody></table>\n";
}

}  // namespace axiscal
