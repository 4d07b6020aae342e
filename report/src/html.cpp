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

std::string rounded(double value, int digits) {
  return number_cell(value, digits).text;
}

std::string section(const std::string& id, const std::string& title, const std::string& content) {
  return content.empty() ? ""
                         : "<section id=\"" + id + "\"><h2>" + escaped(title) + "</h2>\n" +
                               content + "</section>\n";
}

std::string paragraph(const std::string& text) {
  return "<p>" + escaped(text) + "</p>\n";
}

std::string bullets(const std::vector<std::string>& lines) {
  if (lines.empty()) {
    return "";
  }
  constexpr std::size_t most = 100;
  std::string html = "<ul>";
  for (std::size_t i = 0; i < std::min(lines.size(), most); ++i) {
    html += "<li>" + escaped(lines[i]) + "</li>";
  }
  if (lines.size() > most) {
    html += "<li>" + std::to_string(lines.size() - most) + " more of these are in the record</li>";
  }
  return html + "</ul>\n";
}

std::string facts(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string html = "<table class=\"facts\"><tbody>";
  for (const auto& [name, value] : rows) {
    if (!value.empty()) {
      html +=
          "<tr><th scope=\"row\">" + escaped(name) + "</th><td>" + escaped(value) + "</td></tr>";
    }
  }
  return html + "</tbody></table>\n";
}

}  // namespace axiscal
