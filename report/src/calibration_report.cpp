// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/calibration_report.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include <nlohmann/json.hpp>

#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "axiscal/report/run_sheet_page.hpp"
#include "html.hpp"
#include "page_assets.hpp"
#include "report_plots.hpp"

namespace axiscal {
namespace {

using Json = nlohmann::ordered_json;

std::string rounded(double value, int digits = 2) {
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

std::string title_of(const Calibration& calibration) {
  return "Calibration of " + calibration.instrument.kind +
         (calibration.instrument.serial.empty() ? "" : " " + calibration.instrument.serial);
}

// ---- verdict ----

std::string what_it_is_fit_for(const Calibration& calibration) {
  if (calibration.instrument.axis_count() < 3) {
    return "It has fewer than three axes: a reading tells the field along each of them, and apply "
           "says how well.";
  }
  const WorstAngleUncertainty worst = worst_angle_uncertainty(calibration);
  if (!std::isfinite(worst.expanded_deg)) {
    return "The record states no uncertainty: what it is fit for cannot be said.";
  }
  const bool is_direction = worst.quantity == "direction of the field";
  return std::string("One reading tells ") +
         (is_direction ? "the direction of the field" : "pitch and roll") + " to " +
         rounded(worst.expanded_deg) + " degrees or better (95 %) in any attitude" +
         (is_direction
              ? ""
              : "; the worst is " + worst.quantity + ", which counts up to 80 degrees of pitch") +
         (calibration.temperature ? ". That is at the reference temperature." : ".");
}

std::vector<std::string> what_to_watch(const Calibration& calibration) {
  std::vector<std::string> lines;
  for (const CalibrationWarning& warning : calibration.warnings) {
    lines.push_back(warning.message);
  }
  if (calibration.temperature) {
    const TemperatureResponse& over = *calibration.temperature;
    lines.push_back("It holds from temperature " + rounded(over.low, 5) + " to " +
                    rounded(over.high, 5) + "; beyond, results are flagged as extrapolated.");
  } else if (calibration.statistics) {
    lines.emplace_back(
        "It holds at the temperature of the calibration: no temperature was modelled.");
  }
  if (!calibration.left_out.empty()) {
    lines.push_back(std::to_string(calibration.left_out.size()) + " readings were left out.");
  }
  return lines;
}

std::string limits_table(const Verdict& verdict) {
  std::vector<std::vector<Cell>> rows;
  for (const LimitVerdict& limit : verdict.limits) {
    rows.push_back({{limit.parameter, ""},
                    number_cell(limit.value, 7),
                    number_cell(limit.u, 2),
                    number_cell(limit.low.value_or(std::nan("")), 7),
                    number_cell(limit.high.value_or(std::nan("")), 7),
                    {limit.passed ? "passed" : "failed", ""}});
  }
  return html_table("Limits, rule: " + verdict.rule,
                    {"limit", "value", "u", "low", "high", "verdict"}, rows);
}

std::string verdict_section(const Calibration& calibration) {
  std::string state(status_name(calibration.status));
  std::string headline = state == "refused" ? "This calibration was refused. Do not use it."
                         : state == "warning"
                             ? "Calibrated, with something to look at."
                             : "Calibrated. Nothing in the readings speaks against it.";
  if (state == "ok" && !calibration.statistics) {
    state = "warning";
    headline = "Coefficients alone: the record holds no readings that speak for or against them.";
  }
  if (calibration.verdict && !calibration.verdict->passed) {
    state = "refused";
    headline = "It does not meet its limits.";
  } else if (calibration.verdict && state == "ok") {
    headline = "Calibrated, and it meets its limits.";
  }
  std::string html = "<div class=\"verdict " + state + "\" role=\"status\"><strong>" +
                     escaped(headline) + "</strong>\n";
  if (state == "refused" && calibration.suggestion) {
    html += paragraph("Most likely: " + calibration.suggestion->message);
  } else if (state == "refused" && !calibration.warnings.empty()) {
    html += paragraph("Most likely: " + calibration.warnings.front().message);
  }
  if (calibration.status != CalibrationStatus::refused) {
    html += paragraph(what_it_is_fit_for(calibration));
  }
  const std::vector<std::string> watch = what_to_watch(calibration);
  if (!watch.empty()) {
    html += paragraph("What to watch:") + bullets(watch);
  }
  html += "</div>\n";
  return html + (calibration.verdict ? limits_table(*calibration.verdict) : "");
}

// ---- instrument and run ----

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

std::string site_text(const Site& site) {
  return "latitude " + number_text(site.latitude_deg, 8) + " deg, longitude " +
         number_text(site.longitude_deg, 8) + " deg, height " + number_text(site.height_m, 6) +
         " m";
}

std::string run_section(const Calibration& calibration) {
  const Instrument& instrument = calibration.instrument;
  const FieldDescription& field = calibration.field;
  std::vector<std::pair<std::string, std::string>> rows = {
      {"Instrument", instrument.kind},
      {"Serial number", instrument.serial},
      {"Axes, readings in", joined(instrument.axes) + "; " + instrument.unit},
      {"Slot", calibration.slot},
      {"Calibrated", calibration.created},
      {"By", calibration.software},
      {"Method", std::string(method_name(calibration.method)) +
                     (calibration.robust ? ", robust" : "") +
                     (calibration.weights == Weighting::none
                          ? ""
                          : ", weights by " + std::string(weighting_name(calibration.weights)))},
      {"Positioner", !calibration.positioner.empty() ? calibration.positioner
                     : calibration.levelness         ? "nominal cube"
                                                     : ""},
      {"Field", field.kind + ", " + number_text(field.magnitude, 8) + " " + field.unit +
                    (field.model.empty() ? "" : ", model " + field.model)},
      {"Place", field.site ? site_text(*field.site) : ""},
      {"Date of the field", field.date}};
  if (calibration.statistics) {
    rows.emplace_back("Readings used", std::to_string(calibration.statistics->observations));
  }
  if (!calibration.left_out.empty()) {
    std::vector<std::string> runs;
    for (const int run : calibration.left_out) {
      runs.push_back(std::to_string(run));
    }
    rows.emplace_back("Left out: runs", joined(runs));
  }
  for (const InputFileDigest& input : calibration.inputs) {
    rows.emplace_back("File",
                      input.path + (input.sha256.empty() ? "" : ", SHA-256 " + input.sha256));
  }
  std::string html = facts(rows);
  for (const Correction& correction : calibration.corrections) {
    html += paragraph("Corrected on request: " + correction.message);
  }
  return html + bullets(calibration.notes);
}

// ---- the cube ----

// The words of one reading: for the cube's view, and for those who do not see it.
std::string words_of(const Calibration& calibration, const ReadingResidual& residual) {
  std::string text = "Run " + std::to_string(residual.run);
  if (residual.point) {
    text += ": face " + std::string(face_name(residual.point->rest())) + " on the table, " +
            std::string(face_name(residual.point->fence())) + " at the fence";
  }
  text += "; residual";
  for (Eigen::Index k = 0; k < residual.response.size(); ++k) {
    text += (k > 0 ? ", " : " ") + calibration.instrument.axes[static_cast<std::size_t>(k)] + " " +
            rounded(residual.response(k), 3);
  }
  return text + " " + calibration.instrument.unit + (residual.used ? "" : "; left out of the fit");
}

std::set<int> suspects(const Calibration& calibration) {
  std::set<int> runs;
  for (const CalibrationWarning& warning : calibration.warnings) {
    runs.insert(warning.runs.begin(), warning.runs.end());
  }
  return runs;
}

// Which readings the cube is turned to: all, or of many the first of each seat and those that are
// named.
std::vector<bool> readings_of_cube(const Calibration& calibration) {
  const std::vector<ReadingResidual>& all = calibration.residuals;
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

// One reading's row; of many readings without buttons and without digits that nobody sees.
std::string reading_row(const Calibration& calibration,
                        const ReadingResidual& residual,
                        const Observations* observations,
                        Eigen::Index row,
                        bool named,
                        std::optional<std::size_t> button) {
  const bool short_form = !button && calibration.residuals.size() > rows_of_page;
  const std::string run = std::to_string(residual.run);
  std::string html = short_form ? "<tr><th>" : "<tr><th scope=\"row\">";
  html += button ? "<button type=\"button\" aria-pressed=\"false\" data-reading=\"" +
                       std::to_string(*button) + "\">" + run + "</button>"
                 : run;
  html += short_form ? "" : "</th>";
  const auto add = [&](const Cell& cell) {
    html += short_form || cell.value.empty() ? "<td>" : "<td data-value=\"" + cell.value + "\">";
    html += escaped(cell.text) + (short_form ? "" : "</td>");
  };
  const Cell none{"\u2013", ""};
  add(residual.point ? Cell{std::string(face_name(residual.point->rest())), ""} : none);
  add(residual.point ? Cell{std::string(face_name(residual.point->fence())), ""} : none);
  const Eigen::Index m = calibration.instrument.axis_count();
  for (Eigen::Index k = 0; k < m && observations != nullptr; ++k) {
    add(row >= 0 && k < observations->response.cols()
            ? number_cell(observations->response(row, k), 7)
            : none);
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    add(k < residual.response.size() ? number_cell(residual.response(k), 3) : none);
  }
  html += named ? "<td class=\"suspect\">" : "<td>";
  html += !residual.used ? "left out" : named ? "look at it" : "used";
  return html + (short_form ? "" : "</td></tr>");
}

// Of many readings those that are named or shown by the cube come first, then the largest
// residuals.
std::vector<std::size_t> by_importance(const Calibration& calibration,
                                       const std::set<int>& named,
                                       const std::vector<bool>& in_cube) {
  const std::vector<ReadingResidual>& all = calibration.residuals;
  std::vector<double> size(all.size(), 0.0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (Eigen::Index k = 0; k < all[i].response.size(); ++k) {
      const double sd = calibration.statistics ? calibration.statistics->residual_sd(k) : 1.0;
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
  const Instrument& instrument = calibration.instrument;
  std::vector<std::string> head = {"run", "rest", "fence"};
  for (const std::string& axis : instrument.axes) {
    if (observations != nullptr) {
      head.push_back(axis + " [" + instrument.unit + "]");
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
  const std::vector<ReadingResidual>& all = calibration.residuals;
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
  constexpr std::size_t most_bytes = 1U << 20U;
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
          ? paragraph(std::to_string(shown.size()) + " of " + std::to_string(all.size()) +
                      " readings are listed: those that are named above and those with the largest "
                      "residuals. All are in the record.")
          : "";
  return remark + paged_table("Readings", head, shown);
}

Json cube_json(const Calibration& calibration) {
  const Positioner cube;
  const std::vector<bool> in_cube = readings_of_cube(calibration);
  Json readings = Json::array();
  for (std::size_t i = 0; i < calibration.residuals.size(); ++i) {
    const ReadingResidual& residual = calibration.residuals[i];
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
  if (calibration.field.in_table) {
    const Eigen::Vector3d& f = *calibration.field.in_table;
    json["field_in_table"] = {f.x(), f.y(), f.z()};
  }
  return json;
}

std::string cube_section(const Calibration& calibration, const Observations* observations) {
  if (calibration.residuals.empty()) {
    return "";
  }
  std::string html;
  std::set<std::string> drawn;
  std::string seats;
  for (const ReadingResidual& residual : calibration.residuals) {
    if (residual.point) {
      const std::string key = std::string(face_name(residual.point->rest())) +
                              std::string(face_name(residual.point->fence()));
      if (drawn.insert(key).second) {
        seats += "<li>" + seat_svg(*residual.point) + "<p>" +
                 escaped(words_of(calibration, residual)) + "</p></li>";
      }
    }
  }
  if (!seats.empty()) {
    html +=
        "<div id=\"cube\"><div id=\"cube-view\"></div><div id=\"cube-buttons\"><button "
        "type=\"button\" id=\"cube-back\">Back</button><button type=\"button\" "
        "id=\"cube-next\">Next</button><span id=\"cube-reading\" aria-live=\"polite\"></span>"
        "</div><ul class=\"seats\">" +
        seats + "</ul></div>\n";
  }
  return html + readings_table(calibration, observations);
}

// ---- coefficients ----

std::string coefficients_table(const Calibration& calibration) {
  std::vector<std::vector<Cell>> rows;
  const std::vector<ParameterUncertainty> all = parameter_uncertainties(calibration);
  for (const ParameterUncertainty& one : all) {
    rows.push_back({{one.name, ""},
                    number_cell(one.value, 8),
                    number_cell(one.uncertainty.u, 2),
                    number_cell(one.uncertainty.expanded, 2),
                    number_cell(one.uncertainty.degrees_of_freedom, 3),
                    {parameter_unit(calibration, one.name), ""}});
  }
  if (all.empty()) {
    for (const std::string& axis : calibration.instrument.axes) {
      for (const char* const of : {".bias", ".sensitivity.x", ".sensitivity.y", ".sensitivity.z"}) {
        const std::string name = axis + of;
        rows.push_back({{name, ""},
                        number_cell(parameter_value(calibration, name), 8),
                        {},
                        {},
                        {},
                        {parameter_unit(calibration, name), ""}});
      }
    }
  }
  const std::string over =
      calibration.temperature
          ? "; d is the temperature less " + rounded(calibration.temperature->reference, 6)
          : "";
  return html_table("Coefficients: reading = bias + sensitivity times field" + over,
                    {"parameter", "value", "u", "U (95 %)", "degrees of freedom", "unit"}, rows);
}

std::string intrinsic_table(const Calibration& calibration) {
  const IntrinsicParameters intrinsic = intrinsic_parameters(calibration);
  std::vector<std::vector<Cell>> rows;
  for (std::size_t i = 0; i < intrinsic.names.size(); ++i) {
    const bool is_angle = intrinsic.names[i].starts_with("angle.");
    const double factor = is_angle ? deg_per_rad : 1.0;
    const double expanded =
        i < intrinsic.uncertainty.size() ? intrinsic.uncertainty[i].expanded : std::nan("");
    rows.push_back({{intrinsic.names[i], ""},
                    number_cell(factor * intrinsic.values(static_cast<Eigen::Index>(i)), 8),
                    number_cell(factor * expanded, 2),
                    {is_angle ? "deg"
                     : intrinsic.names[i].ends_with("bias")
                         ? calibration.instrument.unit
                         : unit_per(calibration.instrument.unit, calibration.field.unit),
                     ""}});
  }
  return html_table("Independent of the mounting", {"parameter", "value", "U (95 %)", "unit"},
                    rows);
}

std::string polar_table(const Calibration& calibration) {
  std::vector<std::vector<Cell>> rows;
  for (Eigen::Index k = 0; k < calibration.instrument.axis_count(); ++k) {
    const int main = main_axis(calibration.instrument, calibration.response, k);
    const PolarForm polar =
        polar_from_sensitivity(calibration.response.sensitivity.row(k).transpose(), main,
                               calibration.instrument.convention);
    rows.push_back({{calibration.instrument.axes[static_cast<std::size_t>(k)], ""},
                    number_cell(polar.sensitivity, 8),
                    number_cell(polar.coning_angle_rad * deg_per_rad, 5),
                    number_cell(polar.azimuth_rad * deg_per_rad, 5)});
  }
  return html_table("Polar form",
                    {"axis", "sensitivity", "off its nominal axis [deg]", "azimuth [deg]"}, rows);
}

std::string correlation_table(const Calibration& calibration) {
  const Eigen::MatrixXd covariance = parameter_covariance(calibration);
  if (covariance.size() == 0 || !covariance.allFinite()) {
    return "";
  }
  const std::vector<std::string>& names = calibration.statistics->parameter_names;
  const Eigen::VectorXd sd = covariance.diagonal().cwiseSqrt();
  std::vector<std::string> head = {""};
  head.insert(head.end(), names.begin(), names.end());
  std::vector<std::vector<Cell>> rows;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    rows.push_back({{names[static_cast<std::size_t>(i)], ""}});
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double r = covariance(i, j) / (sd(i) * sd(j));
      constexpr double rounding = 1e-12;
      rows.back().push_back(number_cell(std::abs(r) < rounding ? 0.0 : r, 2));
    }
  }
  return "<details><summary>Correlation of the coefficients</summary>" +
         html_table("", head, rows) + "</details>\n";
}

// ---- levelness, uncertainty ----

std::string figures(const std::vector<Plot>& plots) {
  std::string html;
  for (const Plot& plot : plots) {
    html += figure_of(plot);
  }
  return html.empty() ? "" : "<div class=\"plots\">" + html + "</div>\n";
}

std::vector<Plot> all_thinned(std::vector<Plot> plots) {
  std::transform(plots.begin(), plots.end(), plots.begin(),
                 [](Plot& plot) { return thinned(std::move(plot)); });
  return plots;
}

// Microradians as people say them: 2994, 12, 0.8.
std::string micro_text(double radians) {
  const double micro = 1e6 * radians;
  return rounded(std::abs(micro) >= 10.0 ? std::round(micro) : micro,
                 std::abs(micro) >= 10.0 ? 9 : 2);
}

std::string adjusters_table(const BlockLevelness& now, const Surface& table) {
  const Eigen::Matrix2d covariance =
      Eigen::Vector2d(now.standard_error_x, now.standard_error_y).cwiseAbs2().asDiagonal();
  std::vector<std::vector<Cell>> rows;
  for (const AdjusterMove& move : level_table({now.x, now.y}, covariance, table)) {
    rows.push_back({number_cell(1e3 * move.position_m.x(), 4),
                    number_cell(1e3 * move.position_m.y(), 4),
                    number_cell(std::round(1e7 * move.raise_m) / 10.0, 6),
                    number_cell(1e6 * move.uncertainty_m, 2),
                    number_cell(move.turns.value_or(std::nan("")), 3)});
  }
  return html_table("To level the table, raise its adjusters",
                    {"x [mm]", "y [mm]", "raise by [um]", "u", "turns"}, rows);
}

std::string levelness_section(const Calibration& calibration, const std::optional<Surface>& table) {
  const std::vector<Plot> plots = all_thinned(levelness_plots(calibration));
  if (plots.empty()) {
    return "";
  }
  const Levelness& level = *calibration.levelness;
  std::string text = "The table rises by " + micro_text(level.mean_x) + " \u00b1 " +
                     micro_text(level.standard_error_x) + " urad towards +x and " +
                     micro_text(level.mean_y) + " \u00b1 " + micro_text(level.standard_error_y) +
                     " urad towards +y (standard errors). ";
  text += level.consistent ? "The faces agree."
                           : "The faces do not agree: one of them, or the table, moved.";
  // A slope that the faces contradict is no ground for turning screws.
  const bool turns = table && level.consistent &&
                     calibration.status != CalibrationStatus::refused &&
                     field_kind(calibration.field.kind).vertical;
  return paragraph(text) + figures(plots) +
         (turns ? adjusters_table(level.as_it_stands(), *table) : "");
}

std::string uncertainty_section(const Calibration& calibration) {
  std::string html;
  if (const std::optional<BarPlot> bars = budget_plot(calibration)) {
    html += figure_of(*bars);
  }
  for (const HeatMap& map : uncertainty_maps(calibration)) {
    html += figure_of(map);
  }
  return html.empty() ? "" : "<div class=\"plots\">" + html + "</div>\n";
}

std::string history_section(const UnitHistory& unit, const std::vector<Plot>& plots) {
  std::vector<std::vector<Cell>> rows;
  for (const ParameterTrend& trend : unit.trends) {
    rows.push_back({{trend.parameter, ""},
                    number_cell(trend.values.back(), 8),
                    number_cell(trend.slope_per_year, 3),
                    number_cell(trend.slope_u_per_year, 2),
                    number_cell(trend.p_value, 2),
                    {trend.meets_limit_on, ""}});
  }
  return figures(plots) +
         html_table("Trends of " + std::to_string(unit.paths.size()) + " records",
                    {"parameter", "newest", "per year", "u", "p of no trend", "meets its limit on"},
                    rows);
}

// JSON within a script element: no tag can start in it.
std::string within_script(const Json& json) {
  std::string text = json.dump(-1, ' ', true, Json::error_handler_t::replace);
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at)) {
    text.replace(at, 1, "\\u003c");
  }
  return text;
}

}  // namespace

std::string calibration_report(const Calibration& calibration, const ReportOptions& options) {
  const std::vector<Plot> residuals =
      all_thinned(residual_plots(calibration, options.observations));
  const std::vector<Plot> temperature = temperature_plots(calibration);
  const std::vector<Plot> orientations =
      calibration.method == Method::magnitude
          ? all_thinned(orientation_plots(calibration, options.observations))
          : std::vector<Plot>();
  const std::vector<Plot> turns = all_thinned(turn_plots(calibration));
  const std::vector<Plot> noise =
      options.noise != nullptr ? noise_plots(*options.noise) : std::vector<Plot>();
  const auto unit = std::find_if(
      options.history.begin(), options.history.end(),
      [&](const UnitHistory& one) { return one.serial == calibration.instrument.serial; });
  const std::vector<Plot> history =
      unit != options.history.end() ? history_plots(*unit) : std::vector<Plot>();
  const std::vector<std::array<std::string, 3>> sections = {
      {"run", "Instrument and run", run_section(calibration)},
      {"points", "Readings and design points", cube_section(calibration, options.observations)},
      {"coefficients", "Coefficients",
       coefficients_table(calibration) + intrinsic_table(calibration) + polar_table(calibration) +
           correlation_table(calibration)},
      {"residuals", "Residuals", figures(residuals)},
      {"levelness", "Levelness", levelness_section(calibration, options.table)},
      {"uncertainty", "Uncertainty", uncertainty_section(calibration)},
      {"temperature", "Temperature", figures(temperature)},
      {"orientations", "Orientations", figures(orientations)},
      {"turns", "Turns", figures(turns)},
      {"noise", "Noise", figures(noise)},
      {"history", "Drift", unit != options.history.end() ? history_section(*unit, history) : ""}};
  std::string links;
  std::string body;
  for (const auto& [id, title, content] : sections) {
    if (!content.empty()) {
      links += "<li><a href=\"#" + id + "\">" + title + "</a></li>";
      body += section(id, title, content);
    }
  }
  Json data = {{"plots", Json::array()}, {"cube", cube_json(calibration)}};
  for (const std::vector<Plot>* const group :
       {&residuals, &temperature, &orientations, &turns, &noise, &history}) {
    for (const Plot& plot : *group) {
      data["plots"].push_back(plot_json(plot));
    }
  }
  const bool has_script = !report_script().empty();
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      escaped(title_of(calibration)) + "</title>\n<style>" + std::string(report_style()) +
      std::string(seat_style()) + std::string(plot_style()) +
      "</style>\n</head>\n<body>\n<header><h1>" + escaped(title_of(calibration)) +
      "</h1>\n<p class=\"soft\">" +
      escaped(calibration.created.empty() ? "" : "calibrated " + calibration.created + ", ") +
      escaped(calibration.software) + "</p></header>\n<main>\n" + verdict_section(calibration) +
      "<nav aria-label=\"Contents\"><ul>" + links + "</ul></nav>\n" + body + "</main>\n";
  if (has_script) {
    page += "<script type=\"application/json\" id=\"report-data\">" + within_script(data) +
            "</script>\n<script>" + std::string(report_script()) + "</script>\n";
  }
  return page + "</body>\n</html>\n";
}

}  // namespace axiscal
