// SPDX-License-Identifier: Apache-2.0
#include "html.hpp"

#include <algorithm>
#include <cmath>
#include <span>

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

namespace {

std::string table_of(std::string_view caption,
                     const std::vector<std::string>& head,
                     std::span<const std::string> rows) {
  std::string html = "<table data-copy>";
  if (!caption.empty()) {
    html += "<caption>" + escaped(caption) + "</caption>";
  }
  html += "<thead><tr>";
  for (const std::string& name : head) {
    html += "<th scope=\"col\">" + escaped(name) + "</th>";
  }
  html += "</tr></thead><tbody>";
  for (const std::string& row : rows) {
    html += row;
  }
  return html + "</tbody></table>\n";
}

}  // namespace

std::string paged_table(std::string_view caption,
                        const std::vector<std::string>& head,
                        const std::vector<std::string>& rows) {
  const std::span<const std::string> all(rows);
  if (rows.size() <= rows_of_page) {
    return table_of(caption, head, all);
  }
  const std::string what = caption.empty() ? "Table" : escaped(caption);
  std::string html = "<details><summary>" + what + ": " + std::to_string(rows.size()) +
                     " rows, on pages of " + std::to_string(rows_of_page) + "</summary>\n";
  for (std::size_t first = 0; first < rows.size(); first += rows_of_page) {
    const std::size_t count = std::min(rows_of_page, rows.size() - first);
    html += "<details><summary>Rows " + std::to_string(first + 1) + " to " +
            std::to_string(first + count) + "</summary>" +
            table_of("", head, all.subspan(first, count)) + "</details>\n";
  }
  return html + "</details>\n";
}

std::string html_table(std::string_view caption,
                       const std::vector<std::string>& head,
                       const std::vector<std::vector<Cell>>& rows) {
  std::vector<std::string> written;
  for (const std::vector<Cell>& row : rows) {
    std::string html = "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string tag = i == 0 ? "th" : "td";
      html += "<" + tag + (i == 0 ? " scope=\"row\"" : "");
      if (!row[i].value.empty() && row[i].value != row[i].text) {
        html += " data-value=\"" + escaped(row[i].value) + "\"";
      }
      html += ">" + escaped(row[i].text) + "</" + tag + ">";
    }
    written.push_back(html + "</tr>");
  }
  return paged_table(caption, head, written);
}

}  // namespace axiscal
