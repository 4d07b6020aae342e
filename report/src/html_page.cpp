// SPDX-License-Identifier: Apache-2.0
#include "report/src/html_page.hpp"

#include "core/formatted.hpp"
#include "report/src/html.hpp"
#include "report/src/page_assets.hpp"

namespace axiscal {
namespace {

// Returns JSON for a script element. The character `<` is escaped, so that the JSON cannot contain
// a tag.
std::string within_script(const nlohmann::ordered_json& json) {
  std::string text = json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at)) {
    text.replace(at, 1, "\\u003c");
  }
  return text;
}

// The CSS that prints the title at the top of each page.
std::string page_margins(const std::string& title) {
  return formatted("@page {{ @top-left {{ content: {}; }} }}\n", css_string(title));
}

}  // namespace

std::string html_page(const HtmlPage& page) {
  std::string html = formatted(
      "<!DOCTYPE html>\n"
      "<html lang=\"en\">\n"
      "<head>\n"
      "<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n"
      "<style>{}{}{}</style>\n"
      "</head>\n"
      "<body>\n"
      "<header><h1>{}</h1>\n"
      "<p class=\"soft\">{}</p></header>\n"
      "<main>\n{}</main>\n",
      escaped(page.title), report_style(), seat_style(), page_margins(page.title),
      escaped(page.title), escaped(page.subtitle), page.body);
  html += formatted(
      "<script type=\"application/json\" id=\"report-data\">{}</script>\n<script>{}</script>\n",
      within_script({{"cube", page.cube}}), report_script());
  return html + "</body>\n</html>\n";
}

}  // namespace axiscal
