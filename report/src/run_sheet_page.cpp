// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/run_sheet_page.hpp"

#include <algorithm>
#include <functional>

#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/positioner/facing.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"
#include "report/src/page_assets.hpp"

namespace axiscal {
namespace {

// A point of the drawing. The drawing shows the cube as seen from the front, the right and above.
// In the table's frame, the cube extends from -1 to 1 along each axis.
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

// Returns the name of the face whose normal points in a direction of the table's frame.
std::string name_towards(const DesignPoint& point, const Eigen::Vector3d& direction_in_table) {
  return typographic_face(face_name(face_towards(point, direction_in_table)));
}

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
  // The two marked faces are behind and below, so that only their edges are drawn.
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
  svg +=
      label("onfence", {seen(-0.1, 1.0, 1.55).x, 19.0}, typographic_face(fence) + " at the fence");
  svg += label("onrest", {84.0, 183.0}, typographic_face(rest) + " on the table");
  return svg + "</svg>";
}

namespace {

// Returns an input field, which is a line to write on in print.
std::string field(const std::string& name,
                  const std::string& label,
                  const std::string& value,
                  const std::string& more) {
  return formatted("<label>{}<input name=\"{}\" value=\"{}\" autocomplete=\"off\"{}></label>",
                   escaped(label), escaped(name), escaped(value), more);
}

std::string step_item(const RunSheetRow& row,
                      const std::vector<std::string>& cells,
                      const Instrument& instrument,
                      bool with_level) {
  const std::string run = std::to_string(row.run);
  std::string fields;
  for (std::size_t k = 0; k < instrument.axes.size(); ++k) {
    fields += field(formatted("r{}a{}", run, k), instrument.axes[k], "",
                    " inputmode=\"decimal\" data-axis");
  }
  fields += field(formatted("r{}t", run), "temperature",
                  row.temperature ? number_text(*row.temperature) : "",
                  " inputmode=\"decimal\" data-temperature");
  return formatted(
      "<li data-cells=\"{}\"><div class=\"head\"><span class=\"run\">Run {}{}</span><input "
      "type=\"checkbox\" name=\"r{}d\" aria-label=\"Run {} is done\"></div>{}<div "
      "class=\"fields\">{}</div></li>\n",
      escaped(joined(cells, ",")), run, with_level ? ", level " + row.entry.level.text() : "", run,
      run, seat_svg(row.entry.point), fields);
}

}  // namespace

std::string run_sheet_page(const std::vector<RunSheetRow>& sheet,
                           const Instrument& instrument,
                           const std::string& title) {
  const bool several_blocks = !sheet.empty() && sheet.back().block != sheet.front().block;
  const bool with_level = std::any_of(sheet.begin(), sheet.end(), [](const RunSheetRow& row) {
    return row.entry.level != FieldLevel(1.0);
  });
  const RunSheetCells cells = run_sheet_cells(sheet);
  // Hash of the points in their order. The script uses this hash as the key under which the browser
  // stores typed values.
  std::size_t order = 0;
  for (const std::vector<std::string>& row : cells.rows) {
    order = 31 * order + std::hash<std::string>()(joined(row, ","));
  }
  std::string page = formatted(
      "<!DOCTYPE html>\n"
      "<html lang=\"en\">\n"
      "<head>\n"
      "<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; script-src 'unsafe-inline'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n"
      "<style>{}{}</style>\n"
      "</head>\n"
      "<body>\n"
      "<main>\n"
      "<h1>{}</h1>\n"
      "<p>Lay the cube down as drawn. The view is from the front, with the fence behind the cube. "
      "The face named in blue lies on the table; the face named in orange touches the fence. In "
      "each step: wipe feet, table and fence; push the cube at its middle against the fence; let "
      "go; wait until it is still; note the reading{}; tick the box. Keep the order of the "
      "steps.</p>\n"
      "<form id=\"sheet\" data-header=\"{}\" data-axes=\"{}\" data-seed=\"{:x}\" "
      "data-instrument=\"{}\" data-unit=\"{}\">\n"
      "<div class=\"fields about\">{}{}{}</div>\n",
      escaped(title), run_sheet_style(), seat_style(), escaped(title),
      instrument.unit == "1" ? "" : escaped(" in " + instrument.unit),
      escaped(joined(cells.header, ",")), escaped(joined(instrument.axes, "\t")), order,
      escaped(instrument.kind), escaped(instrument.unit),
      field("serial", "Serial number", instrument.serial, ""),
      field("operator", "Operator", "", ""), field("date", "Date", "", ""));
  int block = 0;
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    const RunSheetRow& row = sheet[i];
    if (row.block != block) {
      page += block == 0 ? "" : "</ol>\n";
      if (several_blocks) {
        page += formatted("<h2>Block {}{}</h2>\n", row.block,
                          row.temperature ? ": soak at " + number_text(*row.temperature) : "");
      }
      page += "<ol>\n";
      block = row.block;
    }
    page += step_item(row, cells.rows[i], instrument, with_level);
  }
  page += block == 0 ? "" : "</ol>\n";
  return page +
         formatted(
             "<div class=\"bar\"><span id=\"told\" role=\"status\"></span><button "
             "type=\"button\" id=\"clear\">Clear</button><button type=\"button\" "
             "id=\"save\">Save as CSV</button></div>\n</form>\n</main>\n<script>{}</script>\n"
             "</body>\n</html>\n",
             run_sheet_script());
}

}  // namespace axiscal
