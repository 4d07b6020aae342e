// SPDX-License-Identifier: Apache-2.0
#include "html.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "axiscal/core/formatted.hpp"
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
    html += formatted("<caption>{}</caption>", escaped(caption));
  }
  html += "<thead><tr>";
  for (const std::string& name : head) {
    html += formatted("<th scope=\"col\">{}</th>", escaped(name));
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
  std::string html = formatted("<details><summary>{}: {} rows, on pages of {}</summary>\n", what,
                               rows.size(), rows_of_page);
  for (std::size_t first = 0; first < rows.size(); first += rows_of_page) {
    const std::size_t count = std::min(rows_of_page, rows.size() - first);
    html += formatted("<details><summary>Rows {} to {}</summary>{}</details>\n", first + 1,
                      first + count, table_of("", head, all.subspan(first, count)));
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
      html += formatted("<{}{}", tag, i == 0 ? " scope=\"row\"" : "");
      if (!row[i].value.empty() && row[i].value != row[i].text) {
        html += formatted(" data-value=\"{}\"", escaped(row[i].value));
      }
      html += formatted(">{}</{}>", escaped(row[i].text), tag);
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
                         : formatted("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", id,
                                     escaped(title), content);
}

std::string paragraph(const std::string& text) {
  return formatted("<p>{}</p>\n", escaped(text));
}

std::string bullets(const std::vector<std::string>& lines) {
  if (lines.empty()) {
    return "";
  }
  constexpr std::size_t most = 100;
  std::string html = "<ul>";
  for (std::size_t i = 0; i < std::min(lines.size(), most); ++i) {
    html += formatted("<li>{}</li>", escaped(lines[i]));
  }
  if (lines.size() > most) {
    html += formatted("<li>{} more of these are in the record</li>", lines.size() - most);
  }
  return html + "</ul>\n";
}

std::string facts(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string html = "<table class=\"facts\"><tbody>";
  for (const auto& [name, value] : rows) {
    if (!value.empty()) {
      html +=
          formatted("<tr><th scope=\"row\">{}</th><td>{}</td></tr>", escaped(name), escaped(value));
    }
  }
  return html + "</tbody></table>\n";
}

}  // namespace axiscal
