// SPDX-License-Identifier: Apache-2.0
#include "report/src/html.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <span>

#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "core/formatted.hpp"

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

std::string css_string(std::string_view text) {
  std::string safe = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = std::isalnum(byte) != 0 || byte >= 0x80 || c == ' ' || c == '.' || c == ',';
    safe += plain ? std::string(1, c) : formatted("\\{:x} ", static_cast<unsigned>(byte));
  }
  return safe + "\"";
}

std::string typographic_minus(std::string text) {
  constexpr const char* minus = "\u2212";
  for (std::size_t at = text.find('-'); at != std::string::npos; at = text.find('-', at + 1)) {
    if (at + 1 < text.size() && std::isdigit(static_cast<unsigned char>(text[at + 1])) != 0) {
      text.replace(at, 1, minus);
    }
  }
  return text;
}

std::string svg_number(double value) {
  return number_text(std::round(10.0 * value) / 10.0);
}

std::string typographic_face(std::string_view name) {
  return name.starts_with('-') ? formatted("\u2212{}", name.substr(1)) : std::string(name);
}

Cell rounded_cell(double value, double uncertainty) {
  return {typographic_minus(rounded_value(value, uncertainty)), number_text(value)};
}

Cell number_cell(double value, int digits) {
  if (!std::isfinite(value)) {
    return {"\u2013", ""};
  }
  return {typographic_minus(number_text(value, digits)), number_text(value)};
}

namespace {

// A number as text. `before` is the number of characters before the decimal point. `behind` is the
// number of characters from the decimal point to the end.
struct Figure {
  std::string text;
  std::size_t before = 0;
  std::size_t behind = 0;  // includes the decimal point
};

Figure figure_of(const std::string& plain) {
  const std::size_t point = std::min(plain.find('.'), plain.size());
  return {typographic_minus(plain), point, plain.size() - point};
}

// Returns `count` blanks with the width of a digit. If `with_point` is true, the first blank has
// the width of a decimal point.
std::string blanks(std::size_t count, bool with_point) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) {
    text += with_point && i == 0 ? "\u2008" : "\u2007";
  }
  return text;
}

std::string padded(const Figure& figure, std::size_t before, std::size_t behind) {
  return blanks(before - figure.before, false) + figure.text +
         blanks(behind - figure.behind, figure.behind == 0);
}

}  // namespace

std::vector<Cell> quantity_cells(const std::vector<std::pair<double, double>>& quantities) {
  std::vector<Figure> values;
  std::vector<Figure> uncertainties;
  std::size_t before = 0;
  std::size_t behind = 0;
  std::size_t u_before = 0;
  std::size_t u_behind = 0;
  for (const auto& [value, uncertainty] : quantities) {
    values.push_back(figure_of(rounded_value(value, uncertainty)));
    uncertainties.push_back(figure_of(rounded_uncertainty(uncertainty)));
    before = std::max(before, values.back().before);
    behind = std::max(behind, values.back().behind);
    if (std::isfinite(uncertainty)) {
      u_before = std::max(u_before, uncertainties.back().before);
      u_behind = std::max(u_behind, uncertainties.back().behind);
    }
  }
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    const auto& [value, uncertainty] = quantities[i];
    if (!std::isfinite(value)) {
      cells.push_back({"\u2013", ""});
      continue;
    }
    std::string text = padded(values[i], before, behind);
    if (std::isfinite(uncertainty)) {
      text += " \u00b1\u00a0" + padded(uncertainties[i], u_before, u_behind);
    }
    cells.push_back({std::move(text), number_text(value)});
  }
  return cells;
}

namespace {

std::string table_of(std::string_view caption,
                     const std::vector<std::string>& head,
                     std::span<const std::string> rows) {
  constexpr std::size_t columns_of_page = 10;  // wider tables get a smaller font in print
  std::string html =
      head.size() > columns_of_page ? "<table class=\"wide\" data-copy>" : "<table data-copy>";
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
  std::string html = formatted("<details><summary>{}: {} rows, in groups of {}</summary>\n", what,
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

std::string section(const std::string& id,
                    const std::string& title,
                    const std::string& content,
                    Fold fold) {
  if (content.empty()) {
    return "";
  }
  if (fold == Fold::never) {
    return formatted("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", id, escaped(title), content);
  }
  return formatted(
      "<section id=\"{}\"><details class=\"part\"{}><summary><h2>{}</h2></summary>\n"
      "{}</details></section>\n",
      id, fold == Fold::open ? " open" : "", escaped(title), content);
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
    html += formatted("<li>{} more are in the record</li>", lines.size() - most);
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
