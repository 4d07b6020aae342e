// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/run_sheet_page.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/positioner/facing.hpp"
#include "html.hpp"
#include "page_assets.hpp"

namespace axiscal {
namespace {

// Seen from the front, the right and above: the cube from -1 to 1 in the table's frame.
struct Spot {
  double x;
  double y;
};

Spot seen(double x, double y, double z) {
  constexpr double unit = 36.0;
  return {92.0 + unit * (x + 0.5 * y), 104.0 - unit * (z + 0.4 * y)};
}

std::string corners(const std::vector<Spot>& spots) {
  std::string text;
  for (const Spot& spot : spots) {
    text += formatted("{}{},{}", text.empty() ? "" : " ", svg_number(spot.x), svg_number(spot.y));
  }
  return text;
}

std::string polygon(const std::string& style, const std::vector<Spot>& spots) {
  return formatted("<polygon class=\"{}\" points=\"{}\"/>", style, corners(spots));
}

std::string line(const std::string& style, const std::vector<Spot>& spots) {
  return formatted("<polyline class=\"{}\" points=\"{}\"/>", style, corners(spots));
}

std::string label(const std::string& style, const Spot& at, const std::string& text) {
  return formatted("<text class=\"{}\" x=\"{}\" y=\"{}\">{}</text>", style, svg_number(at.x),
                   svg_number(at.y), text);
}

// The name of the face that looks along an axis of the table.
std::string name_towards(const DesignPoint& point, const Eigen::Vector3d& direction_in_table) {
  return true_face(face_name(face_towards(point, direction_in_table)));
}

constexpr const char* page_style = R"css(
  :root { color-scheme: light; }
  body { font: 11pt/1.35 system-ui, sans-serif; color: #1a1a1a; background: #fff; margin: 12mm; }
  h1 { font-size: 16pt; margin: 0 0 2mm; }
  p { margin: 0 0 4mm; max-width: 62em; }
  h2 { font-size: 12pt; margin: 4mm 0 2mm; break-after: avoid; }
  ol { list-style: none; padding: 0; margin: 0; display: grid;
       grid-template-columns: repeat(auto-fill, minmax(43mm, 1fr)); gap: 3mm; }
  li { border: 0.3mm solid #767676; border-radius: 1.5mm; padding: 1.5mm; break-inside: avoid; }
  .head { display: flex; justify-content: space-between; align-items: center; font-weight: 600; }
  .box { display: inline-block; width: 4.5mm; height: 4.5mm; border: 0.4mm solid #1a1a1a; }
  svg { display: block; width: 100%; height: auto; }
  @page { size: auto; margin: 10mm; }
  @media print { body { margin: 0; } ol { grid-template-columns: repeat(4, 1fr); }
    * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
)css";

}  // namespace

std::string seat_svg(const DesignPoint& point) {
  const std::string rest(face_name(point.rest()));
  const std::string fence(face_name(point.fence()));
  std::string svg = R"(<svg viewBox="0 0 200 190" role="img" aria-label="Face )" + rest +
                    " on the table, face " + fence + " at the fence\">";
  svg += polygon("table", {seen(-1.5, -1.8, -1.0), seen(1.5, -1.8, -1.0), seen(1.5, 1.0, -1.0),
                           seen(-1.5, 1.0, -1.0)});
  svg += polygon("wall", {seen(-1.5, 1.0, -1.0), seen(1.5, 1.0, -1.0), seen(1.5, 1.0, 1.35),
                          seen(-1.5, 1.0, 1.35)});
  // The two faces that are marked lie behind and below: their edges show.
  svg += line("fence", {seen(-1.0, 1.0, -1.0), seen(-1.0, 1.0, 1.0), seen(1.0, 1.0, 1.0),
                        seen(1.0, 1.0, -1.0)});
  svg += polygon("top", {seen(-1.0, -1.0, 1.0), seen(1.0, -1.0, 1.0), seen(1.0, 1.0, 1.0),
                         seen(-1.0, 1.0, 1.0)});
  svg += polygon("front", {seen(-1.0, -1.0, -1.0), seen(1.0, -1.0, -1.0), seen(1.0, -1.0, 1.0),
                           seen(-1.0, -1.0, 1.0)});
  svg += polygon("side", {seen(1.0, -1.0, -1.0), seen(1.0, 1.0, -1.0), seen(1.0, 1.0, 1.0),
                          seen(1.0, -1.0, 1.0)});
  svg += line("rest", {seen(-1.0, -1.0, -1.0), seen(1.0, -1.0, -1.0), seen(1.0, 1.0, -1.0)});
  const Spot top = seen(0.0, 0.0, 1.0);
  const Spot front = seen(0.0, -1.0, 0.0);
  const Spot side = seen(1.0, 0.0, 0.0);
  svg += label("name", {top.x, top.y + 6.0}, name_towards(point, Eigen::Vector3d::UnitZ()));
  svg += label("name", {front.x, front.y + 6.0}, name_towards(point, -Eigen::Vector3d::UnitY()));
  svg += label("name", {side.x, side.y + 6.0}, name_towards(point, Eigen::Vector3d::UnitX()));
  svg += label("onfence", {seen(-0.1, 1.0, 1.55).x, 19.0}, true_face(fence) + " at the fence");
  svg += label("onrest", {84.0, 183.0}, true_face(rest) + " on the table");
  return svg + "</svg>";
}

std::string run_sheet_page(const std::vector<RunSheetRow>& sheet, const std::string& title) {
  const bool several_blocks = !sheet.empty() && sheet.back().block != sheet.front().block;
  const bool with_level = std::any_of(sheet.begin(), sheet.end(), [](const RunSheetRow& row) {
    return row.entry.level != FieldLevel(1.0);
  });
  std::string page = formatted(
      "<!DOCTYPE html>\n"
      "<html lang=\"en\">\n"
      "<head>\n"
      "<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width\">\n"
      "<title>{}</title>\n"
      "<style>{}{}</style>\n"
      "</head>\n"
      "<body>\n"
      "<h1>{}</h1>\n"
      "<p>Lay the cube down as drawn, seen from the front with the fence behind it: the face named "
      "in blue on the table, the one named in orange pushed against the fence. Wipe feet, table "
      "and fence; push at the middle; let go; wait until it is still; take the reading; tick the "
      "box. Take the steps in this order.</p>\n",
      escaped(title), page_style, seat_style(), escaped(title));
  int block = 0;
  for (const RunSheetRow& row : sheet) {
    if (row.block != block) {
      page += block == 0 ? "" : "</ol>\n";
      if (several_blocks) {
        page += formatted("<h2>Block {}{}</h2>\n", row.block,
                          row.temperature ? ": soak at " + number_text(*row.temperature) : "");
      }
      page += "<ol>\n";
      block = row.block;
    }
    page += formatted(
        "<li><div class=\"head\"><span>Run {}{}</span><span class=\"box\"></span></div>{}</li>\n",
        row.run, with_level ? ", level " + row.entry.level.text() : "", seat_svg(row.entry.point));
  }
  page += block == 0 ? "" : "</ol>\n";
  page += "</body>\n</html>\n";
  return page;
}

}  // namespace axiscal
