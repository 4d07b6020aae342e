// SPDX-License-Identifier: Apache-2.0
#include "report/src/readings_section.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <vector>

#include "axiscal/positioner/positioner.hpp"
#include "axiscal/report/run_sheet_page.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"

namespace axiscal {
namespace {

using Json = nlohmann::ordered_json;

// Describes a reading in words, for the drawing of the cube and for screen readers.
std::string words_of(const Calibration& calibration, const ReadingResidual& residual) {
  std::string text = formatted("Run {}", residual.run);
  if (residual.point) {
    text += formatted(": face {} on the table, {} at the fence",
                      typographic_face(face_name(residual.point->rest())),
                      typographic_face(face_name(residual.point->fence())));
  }
  text += "; residual";
  for (Eigen::Index k = 0; k < residual.response.size(); ++k) {
    text += formatted("{}{} {}", k > 0 ? ", " : " ",
                      calibration.sensor.instrument.axes[static_cast<std::size_t>(k)],
                      rounded(residual.response(k), 3));
  }
  return formatted("{} {}{}", text, calibration.sensor.instrument.unit,
                   residual.used ? "" : "; left out of the fit");
}

std::set<int> suspects(const Calibration& calibration) {
  std::set<int> runs;
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    runs.insert(warning.runs.begin(), warning.runs.end());
  }
  return runs;
}

// Selects the readings whose poses the page can draw: all readings with a pose if the run is short.
// In a long run, selects the first reading of each pose and the readings that a warning names.
std::vector<bool> readings_of_cube(const Calibration& calibration) {
  const std::vector<ReadingResidual>& all = calibration.fit.residuals;
  const bool few = all.size() <= rows_of_page;
  const std::set<int> named = suspects(calibration);
  std::set<DesignPoint> seen;
  std::vector<bool> chosen(all.size(), false);
  std::size_t count = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    chosen[i] = all[i].point && count < rows_of_page &&
                (few || named.contains(all[i].run) || !seen.contains(*all[i].point));
    if (chosen[i]) {
      seen.insert(*all[i].point);
      ++count;
    }
  }
  return chosen;
}

// Returns the table row of a reading. In a long table, a row without a button has no attributes and
// no end tags, to keep the page small.
std::string reading_row(const Calibration& calibration,
                        const ReadingResidual& residual,
                        const Observations* observations,
                        Eigen::Index row,
                        bool named,
                        std::optional<std::size_t> button) {
  const bool short_form = !button && calibration.fit.residuals.size() > rows_of_page;
  const std::string run = std::to_string(residual.run);
  std::string html =
      short_form ? "<tr><th>" : formatted("<tr data-run=\"{}\"><th scope=\"row\">", run);
  html +=
      button ? formatted(
                   "<button type=\"button\" aria-pressed=\"false\" data-reading=\"{}\">{}</button>",
                   *button, run)
             : run;
  html += short_form ? "" : "</th>";
  const auto add = [&](const Cell& cell) {
    html +=
        short_form || cell.value.empty() ? "<td>" : formatted("<td data-value=\"{}\">", cell.value);
    html += escaped(cell.text) + (short_form ? "" : "</td>");
  };
  const Cell none{"\u2013", ""};
  add(residual.point ? Cell{typographic_face(face_name(residual.point->rest())), ""} : none);
  add(residual.point ? Cell{typographic_face(face_name(residual.point->fence())), ""} : none);
  const Eigen::Index m = calibration.sensor.instrument.axis_count();
  for (Eigen::Index k = 0; k < m && observations != nullptr; ++k) {
    add(row >= 0 && k < observations->response.cols()
            ? number_cell(observations->response(row, k), 7)
            : none);
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    add(k < residual.response.size() ? number_cell(residual.response(k), 3) : none);
  }
  html += named ? "<td class=\"suspect\">" : "<td>";
  html += !residual.used ? "left out" : named ? "suspect" : "used";
  return html + (short_form ? "" : "</td></tr>");
}

// Returns the indices of the readings by importance. Readings that a warning names or that the cube
// shows are first. The others follow in the order of decreasing residuals.
std::vector<std::size_t> by_importance(const Calibration& calibration,
                                       const std::set<int>& named,
                                       const std::vector<bool>& in_cube) {
  const std::vector<ReadingResidual>& all = calibration.fit.residuals;
  std::vector<double> size(all.size(), 0.0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (Eigen::Index k = 0; k < all[i].response.size(); ++k) {
      const double sd =
          calibration.fit.statistics ? calibration.fit.statistics->residual_sd(k) : 1.0;
      const double own = std::abs(all[i].response(k)) / (sd > 0.0 ? sd : 1.0);
      size[i] = std::isfinite(own) ? std::max(size[i], own) : size[i];
    }
    const bool is_shown = in_cube[i] || named.contains(all[i].run);
    size[i] = is_shown ? std::numeric_limits<double>::infinity() : size[i];
  }
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return size[a] > size[b]; });
  return order;
}

std::string readings_table(const Calibration& calibration, const Observations* observations) {
  const Instrument& instrument = calibration.sensor.instrument;
  std::vector<std::string> head = {"run", "rest", "fence"};
  for (const std::string& axis : instrument.axes) {
    if (observations != nullptr) {
      head.push_back(formatted("{} [{}]", axis, instrument.unit));
    }
  }
  for (const std::string& axis : instrument.axes) {
    head.push_back("residual " + axis);
  }
  head.emplace_back("state");
  const std::set<int> named = suspects(calibration);
  std::map<int, Eigen::Index> row_of_run;
  for (std::size_t i = 0; observations != nullptr && i < observations->readings.size(); ++i) {
    row_of_run[observations->readings[i].run] = static_cast<Eigen::Index>(i);
  }
  const std::vector<ReadingResidual>& all = calibration.fit.residuals;
  const std::vector<bool> in_cube = readings_of_cube(calibration);
  std::vector<std::string> rows;
  std::size_t seat = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto found = row_of_run.find(all[i].run);
    const Eigen::Index row = found == row_of_run.end() ? -1 : found->second;
    std::optional<std::size_t> button;
    if (in_cube[i]) {
      button = seat++;
    }
    rows.push_back(
        reading_row(calibration, all[i], observations, row, named.contains(all[i].run), button));
  }
  constexpr std::size_t most_bytes = 1U << 18U;
  std::size_t bytes = 0;
  std::vector<std::size_t> listed;
  for (const std::size_t i : by_importance(calibration, named, in_cube)) {
    bytes += rows[i].size();
    if (bytes > most_bytes) {
      break;
    }
    listed.push_back(i);
  }
  std::sort(listed.begin(), listed.end());
  std::vector<std::string> shown;
  for (const std::size_t i : listed) {
    shown.push_back(std::move(rows[i]));
  }
  const std::string remark =
      shown.size() < all.size()
          ? paragraph(formatted("{} of {} readings are listed: the readings named above, and the "
                                "readings with the largest residuals. The record has all readings.",
                                shown.size(), all.size()))
          : "";
  return remark + paged_table("Readings", head, shown);
}

}  // namespace

Json cube_json(const Calibration& calibration) {
  const Positioner cube;
  const std::vector<bool> in_cube = readings_of_cube(calibration);
  Json readings = Json::array();
  for (std::size_t i = 0; i < calibration.fit.residuals.size(); ++i) {
    const ReadingResidual& residual = calibration.fit.residuals[i];
    if (!in_cube[i]) {
      continue;
    }
    const Eigen::Matrix3d R = cube.rotation_table_from_positioner(*residual.point);
    Json rotation = Json::array();
    for (Eigen::Index row = 0; row < 3; ++row) {
      rotation.push_back({R(row, 0), R(row, 1), R(row, 2)});
    }
    readings.push_back(
        {{"text", words_of(calibration, residual)}, {"rotation_table_from_positioner", rotation}});
  }
  Json json = {{"readings", readings}, {"field_in_table", nullptr}};
  if (calibration.sensor.field.in_table) {
    const Eigen::Vector3d& f = *calibration.sensor.field.in_table;
    json["field_in_table"] = {f.x(), f.y(), f.z()};
  }
  return json;
}

namespace {

// Returns the text that explains the blue arrow beside the cube.
std::string words_of_arrow(const Calibration& calibration) {
  const FieldDescription& field = calibration.sensor.field;
  if (!field.in_table) {
    return "";
  }
  return formatted("<p class=\"soft arrow\">Blue arrow: {}.</p>",
                   field.kind == "gravity"
                       ? "the reading of an accelerometer at rest, which points upwards"
                       : escaped(formatted("the direction of the field ({})", field.kind)));
}

}  // namespace

std::string cube_section(const Calibration& calibration, const Observations* observations) {
  if (calibration.fit.residuals.empty()) {
    return "";
  }
  std::string html;
  std::set<std::string> drawn;
  std::string seats;
  for (const ReadingResidual& residual : calibration.fit.residuals) {
    if (residual.point) {
      const std::string key = std::string(face_name(residual.point->rest())) +
                              std::string(face_name(residual.point->fence()));
      if (drawn.insert(key).second) {
        seats += formatted("<li>{}<p>{}</p></li>", seat_svg(*residual.point),
                           escaped(words_of(calibration, residual)));
      }
    }
  }
  if (!seats.empty()) {
    html += formatted(
        "<div id=\"cube\"><div id=\"cube-view\"></div><div id=\"cube-buttons\"><button "
        "type=\"button\" id=\"cube-back\">Back</button><button type=\"button\" "
        "id=\"cube-next\">Next</button><span id=\"cube-reading\" "
        "aria-live=\"polite\"></span></div>{}<ul class=\"seats\">{}</ul></div>\n",
        words_of_arrow(calibration), seats);
  }
  return html + readings_table(calibration, observations);
}

}  // namespace axiscal
