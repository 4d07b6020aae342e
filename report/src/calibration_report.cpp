// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/calibration_report.hpp"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/summary.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "html.hpp"
#include "page_assets.hpp"
#include "readings_section.hpp"
#include "report_plots.hpp"

namespace axiscal {
namespace {

using Json = nlohmann::ordered_json;

std::string title_of(const Calibration& calibration) {
  return formatted("Calibration of {}{}", calibration.sensor.instrument.kind,
                   calibration.sensor.instrument.serial.empty()
                       ? ""
                       : " " + calibration.sensor.instrument.serial);
}

// ---- verdict ----

std::string what_it_is_fit_for(const Calibration& calibration) {
  if (calibration.sensor.instrument.axis_count() < 3) {
    return "It has fewer than three axes: a reading tells the field along each of them, and apply "
           "says how well.";
  }
  const WorstAngleUncertainty worst = worst_angle_uncertainty(calibration);
  if (!std::isfinite(worst.expanded_deg)) {
    return "The record states no uncertainty: what it is fit for cannot be said.";
  }
  const bool is_direction = worst.quantity == "direction of the field";
  return formatted(
      "One reading tells {} to {} degrees or better (95 %) in any attitude{}{}",
      is_direction ? "the direction of the field" : "pitch and roll", rounded(worst.expanded_deg),
      is_direction
          ? ""
          : formatted("; the worst is {}, which counts up to 80 degrees of pitch", worst.quantity),
      calibration.sensor.temperature ? ". That is at the reference temperature." : ".");
}

std::vector<std::string> what_to_watch(const Calibration& calibration) {
  std::vector<std::string> lines;
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    lines.push_back(warning.message);
  }
  if (calibration.sensor.temperature) {
    const TemperatureResponse& over = *calibration.sensor.temperature;
    lines.push_back(formatted(
        "It holds from temperature {}; beyond, results are flagged as extrapolated.",
        span_text(over, calibration.sensor.instrument.axes, [](const TemperatureSpan& span) {
          return formatted("{} to {}", rounded(span.low, 5), rounded(span.high, 5));
        })));
  } else if (calibration.fit.statistics) {
    lines.emplace_back(
        "It holds at the temperature of the calibration: no temperature was modelled.");
  }
  if (std::string missing = words_of_not_counted(calibration); !missing.empty()) {
    lines.push_back(std::move(missing));
  }
  if (!calibration.fit.left_out.empty()) {
    lines.push_back(formatted("{} readings were left out.", calibration.fit.left_out.size()));
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
  std::string state(status_name(calibration.findings.status));
  std::string headline = state == "refused" ? "This calibration was refused. Do not use it."
                         : state == "warning"
                             ? "Calibrated, with something to look at."
                             : "Calibrated. Nothing in the readings speaks against it.";
  if (state == "ok" && !calibration.fit.statistics) {
    state = "warning";
    headline = "Coefficients alone: the record holds no readings that speak for or against them.";
  }
  if (calibration.findings.verdict && !calibration.findings.verdict->passed) {
    state = "refused";
    headline = "It does not meet its limits.";
  } else if (calibration.findings.verdict && state == "ok") {
    headline = "Calibrated, and it meets its limits.";
  }
  std::string html = formatted("<div class=\"verdict {}\" role=\"status\"><strong>{}</strong>\n",
                               state, escaped(headline));
  if (state == "refused" && calibration.findings.suggestion) {
    html += paragraph("Most likely: " + calibration.findings.suggestion->message);
  } else if (state == "refused" && !calibration.findings.warnings.empty()) {
    html += paragraph("Most likely: " + calibration.findings.warnings.front().message);
  }
  if (calibration.findings.status != CalibrationStatus::refused) {
    html += paragraph(what_it_is_fit_for(calibration));
  }
  const std::vector<std::string> watch = what_to_watch(calibration);
  if (!watch.empty()) {
    html += paragraph("What to watch:") + bullets(watch);
  }
  html += "</div>\n";
  return html + (calibration.findings.verdict ? limits_table(*calibration.findings.verdict) : "");
}

// ---- instrument and run ----

std::string site_text(const Site& site) {
  return formatted("latitude {} deg, longitude {} deg, height {} m",
                   number_text(site.latitude_deg, 8), number_text(site.longitude_deg, 8),
                   number_text(site.height_m, 6));
}

std::string run_section(const Calibration& calibration) {
  const Instrument& instrument = calibration.sensor.instrument;
  const FieldDescription& field = calibration.sensor.field;
  std::vector<std::pair<std::string, std::string>> rows = {
      {"Instrument", instrument.kind},
      {"Serial number", instrument.serial},
      {"Axes, readings in", formatted("{}; {}", joined(instrument.axes), instrument.unit)},
      {"Slot", calibration.provenance.slot},
      {"Calibrated", calibration.provenance.created},
      {"By", calibration.provenance.software},
      {"Method",
       std::string(method_name(calibration.fit.method)) +
           (calibration.fit.robust ? ", robust" : "") +
           (calibration.fit.weights == Weighting::none
                ? ""
                : ", weights by " + std::string(weighting_name(calibration.fit.weights)))},
      {"Positioner", !calibration.provenance.positioner.empty() ? calibration.provenance.positioner
                     : calibration.fit.levelness                ? "nominal cube"
                                                                : ""},
      {"Field", formatted("{}, {} {}{}", field.kind, number_text(field.magnitude, 8), field.unit,
                          field.model.empty() ? "" : ", model " + field.model)},
      {"Place", field.site ? site_text(*field.site) : ""},
      {"Date of the field", field.date}};
  if (calibration.fit.statistics) {
    rows.emplace_back("Readings used", std::to_string(calibration.fit.statistics->observations));
  }
  if (!calibration.fit.left_out.empty()) {
    std::vector<std::string> runs;
    for (const int run : calibration.fit.left_out) {
      runs.push_back(std::to_string(run));
    }
    rows.emplace_back("Left out: runs", joined(runs));
  }
  for (const InputFileDigest& input : calibration.provenance.inputs) {
    rows.emplace_back("File",
                      input.path + (input.sha256.empty() ? "" : ", SHA-256 " + input.sha256));
  }
  std::string html = facts(rows);
  for (const Correction& correction : calibration.findings.corrections) {
    html += paragraph("Corrected on request: " + correction.message);
  }
  std::vector<std::string> notes;
  for (const CalibrationNote& note : calibration.findings.notes) {
    notes.push_back(note.message);
  }
  return html + bullets(notes);
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
    for (const std::string& axis : calibration.sensor.instrument.axes) {
      for (const char* const of : {".bias", ".sensitivity.x", ".sensitivity.y", ".sensitivity.z"}) {
        const std::string name = axis + of;
        rows.push_back({{name, ""},
                        number_cell(parameter_value(calibration.sensor, name), 8),
                        {},
                        {},
                        {},
                        {parameter_unit(calibration, name), ""}});
      }
    }
  }
  const std::string over =
      calibration.sensor.temperature
          ? "; d is the temperature less " +
                span_text(*calibration.sensor.temperature, calibration.sensor.instrument.axes,
                          [](const TemperatureSpan& span) { return rounded(span.reference, 6); })
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
    rows.push_back(
        {{intrinsic.names[i], ""},
         number_cell(factor * intrinsic.values(static_cast<Eigen::Index>(i)), 8),
         number_cell(factor * expanded, 2),
         {is_angle ? "deg"
          : intrinsic.names[i].ends_with("bias")
              ? calibration.sensor.instrument.unit
              : unit_per(calibration.sensor.instrument.unit, calibration.sensor.field.unit),
          ""}});
  }
  return html_table("Independent of the mounting", {"parameter", "value", "U (95 %)", "unit"},
                    rows);
}

std::string polar_table(const Calibration& calibration) {
  std::vector<std::vector<Cell>> rows;
  for (Eigen::Index k = 0; k < calibration.sensor.instrument.axis_count(); ++k) {
    const int main = main_axis(calibration.sensor.instrument, calibration.sensor.response, k);
    const PolarForm polar =
        polar_from_sensitivity(calibration.sensor.response.sensitivity.row(k).transpose(), main,
                               calibration.sensor.instrument.convention);
    rows.push_back({{calibration.sensor.instrument.axes[static_cast<std::size_t>(k)], ""},
                    number_cell(std::abs(polar.sensitivity), 8),
                    number_cell(polar.coning_angle_rad * deg_per_rad, 5),
                    number_cell(polar.azimuth_rad * deg_per_rad, 5)});
  }
  return html_table(
      "Polar form: the size of the sensitivity, and where the axis points; the azimuth as the "
      "known-art formulas count it, in axes forward-right-down",
      {"axis", "size", "off its nominal axis [deg]", "azimuth [deg]"}, rows);
}

std::string correlation_table(const Calibration& calibration) {
  const Eigen::MatrixXd covariance = parameter_covariance(calibration);
  if (covariance.size() == 0 || !covariance.allFinite()) {
    return "";
  }
  const std::vector<std::string>& names = calibration.fit.statistics->parameter_names;
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
  return formatted("<details><summary>Correlation of the coefficients</summary>{}</details>\n",
                   html_table("", head, rows));
}

// How the other instruments of the assembly are turned against this one.
std::string alignments_table(const Calibration& calibration) {
  std::vector<std::vector<Cell>> rows;
  for (const SlotAlignment& other : calibration.fit.slot_alignments) {
    const Eigen::Vector3d turn = turn_beside_quarters(other);
    std::vector<Cell>& row = rows.emplace_back(std::vector<Cell>{{other.slot, ""}});
    for (Eigen::Index j = 0; j < 3; ++j) {
      row.push_back(number_cell(1e3 * turn(j)));
      row.push_back(number_cell(1e3 * other.expanded_rad(j), 2));
    }
  }
  return rows.empty() ? ""
                      : html_table("Axes of the assembly's other instruments against these [mrad]",
                                   {"slot", "about x", "U (95 %)", "about y", "U (95 %)", "about z",
                                    "U (95 %)"},
                                   rows);
}

// ---- levelness, uncertainty ----

// What the fit says of itself beside its residuals.
std::string words_on_fit(const Calibration& calibration) {
  std::string html;
  for (const std::string& words :
       {words_of_field_size(calibration), words_of_confirmation(calibration)}) {
    html += words.empty() ? "" : paragraph(words);
  }
  return html;
}

std::string figures(const std::vector<Plot>& plots) {
  std::string html;
  for (const Plot& plot : plots) {
    html += figure_of(plot);
  }
  return html.empty() ? "" : formatted("<div class=\"plots\">{}</div>\n", html);
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
  const Levelness& level = *calibration.fit.levelness;
  std::string text = formatted(
      "The table rises by {} \u00b1 {} urad towards +x and {} \u00b1 {} urad towards +y (standard "
      "errors). ",
      micro_text(level.mean_x), micro_text(level.standard_error_x), micro_text(level.mean_y),
      micro_text(level.standard_error_y));
  text += level.consistent ? "The faces agree."
                           : "The faces do not agree: one of them, or the table, moved.";
  // A slope that the faces contradict is no ground for turning screws.
  const bool turns = table && level.consistent &&
                     calibration.findings.status != CalibrationStatus::refused &&
                     field_kind(calibration.sensor.field.kind).vertical;
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
  return html.empty() ? "" : formatted("<div class=\"plots\">{}</div>\n", html);
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
      calibration.fit.method == Method::magnitude
          ? all_thinned(orientation_plots(calibration, options.observations))
          : std::vector<Plot>();
  const std::vector<Plot> turns = all_thinned(turn_plots(calibration));
  const std::vector<Plot> noise =
      options.noise != nullptr ? noise_plots(*options.noise) : std::vector<Plot>();
  const auto unit = std::find_if(
      options.history.begin(), options.history.end(),
      [&](const UnitHistory& one) { return one.serial == calibration.sensor.instrument.serial; });
  const std::vector<Plot> history =
      unit != options.history.end() ? history_plots(*unit) : std::vector<Plot>();
  const std::vector<std::array<std::string, 3>> sections = {
      {"run", "Instrument and run", run_section(calibration)},
      {"points", "Readings and design points", cube_section(calibration, options.observations)},
      {"coefficients", "Coefficients",
       coefficients_table(calibration) + intrinsic_table(calibration) + polar_table(calibration) +
           alignments_table(calibration) + correlation_table(calibration)},
      {"residuals", "Residuals", words_on_fit(calibration) + figures(residuals)},
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
      links += formatted("<li><a href=\"#{}\">{}</a></li>", id, title);
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
  std::string page = formatted(
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
      "<p class=\"soft\">{}{}</p></header>\n"
      "<main>\n"
      "{}<nav aria-label=\"Contents\"><ul>{}</ul></nav>\n"
      "{}</main>\n",
      escaped(title_of(calibration)), report_style(), seat_style(), plot_style(),
      escaped(title_of(calibration)),
      escaped(calibration.provenance.created.empty()
                  ? ""
                  : formatted("calibrated {}, ", calibration.provenance.created)),
      escaped(calibration.provenance.software), verdict_section(calibration), links, body);
  if (has_script) {
    page += formatted(
        "<script type=\"application/json\" id=\"report-data\">{}</script>\n<script>{}</script>\n",
        within_script(data), report_script());
  }
  return page + "</body>\n</html>\n";
}

}  // namespace axiscal
