// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/calibration_report.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/calib/summary.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "axiscal/field/field_kind.hpp"
#include "core/formatted.hpp"
#include "report/src/coefficients_section.hpp"
#include "report/src/html.hpp"
#include "report/src/html_page.hpp"
#include "report/src/noise_section.hpp"
#include "report/src/readings_section.hpp"
#include "report/src/report_plots.hpp"
#include "report/src/story_section.hpp"
#include "report/src/verdict_section.hpp"

namespace axiscal {
namespace {

std::string title_of(const Calibration& calibration) {
  return formatted("Calibration of {}{}", calibration.sensor.instrument.kind,
                   calibration.sensor.instrument.serial.empty()
                       ? ""
                       : " " + calibration.sensor.instrument.serial);
}

// ---- Section on the instrument and the run ----

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
      {"Axes; unit", formatted("{}; {}", joined(instrument.axes), instrument.unit)},
      {"Slot", calibration.provenance.slot},
      {"Calibrated", calibration.provenance.date()},
      {"Operator", calibration.provenance.operated_by},
      {"Computed", calibration.provenance.measured.empty() ? "" : calibration.provenance.created},
      {"Software", calibration.provenance.software},
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
    rows.emplace_back("Runs left out", joined(runs));
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
    if (note.code != NoteCode::not_counted) {  // verdict_section() shows this note
      notes.push_back(note.message);
    }
  }
  return html + bullets(notes);
}

// ---- Sections on levelness and uncertainty ----

// Returns sentences on the magnitude of the field and on the confirmation readings.
std::string words_on_fit(const Calibration& calibration) {
  std::string html;
  for (const std::string& words :
       {field_size_sentence(calibration), confirmation_sentence(calibration)}) {
    html += words.empty() ? "" : paragraph(words);
  }
  return html;
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

std::string levelness_section(const Calibration& calibration,
                              const std::optional<Surface>& table,
                              Figures& figures) {
  if (!calibration.fit.levelness || calibration.fit.levelness->estimates.empty()) {
    return "";
  }
  const Levelness& level = *calibration.fit.levelness;
  const bool slope = field_kind(calibration.sensor.field.kind).vertical;
  const auto stated = [](double value, double u) {
    return typographic_minus(formatted("{} \u00b1 {}", rounded_value(1e3 * value, 1e3 * u),
                                       rounded_uncertainty(1e3 * u)));
  };
  const std::string x = stated(level.mean_x, level.standard_error_x);
  const std::string y = stated(level.mean_y, level.standard_error_y);
  std::string text =
      slope ? formatted("The table rises by {} mrad towards +x and {} mrad towards +y", x, y)
            : formatted(
                  "The field in the table's plane is {} along x and {} along y, in thousandths of "
                  "the field's magnitude",
                  x, y);
  text += " (standard uncertainties). ";
  if (!std::isnan(level.p_value)) {
    text += level.consistent ? "The estimates from the faces agree."
                             : "The estimates from the faces do not agree: look for grit under a "
                               "foot, a wrong face or a moved table.";
  }
  const std::optional<Plot> faces = faces_plot(calibration);
  // The turns of the adjusters are listed only if the slopes measured with all faces agree.
  const bool turns = table && level.consistent &&
                     calibration.findings.status != CalibrationStatus::refused && slope;
  return paragraph(text) + (faces ? figures.add(*faces) : "") +
         (turns ? adjusters_table(level.current_levelness(), *table) : "");
}

std::string uncertainty_section(const Calibration& calibration, Figures& figures) {
  std::string html;
  if (const std::optional<BarPlot> bars = budget_plot(calibration)) {
    html += figures.add(*bars);
  }
  for (const HeatMap& map : uncertainty_maps(calibration)) {
    html += figures.add(map);
  }
  return Figures::side_by_side(html);
}

std::string residuals_section(const Calibration& calibration,
                              const Observations* observations,
                              Figures& figures) {
  std::vector<Plot> plots = residual_plots(calibration, observations);
  if (std::optional<Plot> magnitudes = magnitude_plot(calibration)) {
    plots.insert(plots.begin(), std::move(*magnitudes));
  }
  return words_on_fit(calibration) + figures.add_all(plots);
}

std::string history_section(const UnitHistory& unit, Figures& figures) {
  std::vector<std::vector<Cell>> rows;
  for (const ParameterTrend& trend : unit.trends) {
    rows.push_back({{trend.parameter, ""},
                    rounded_cell(trend.values.back(), trend.u.back()),
                    rounded_cell(trend.slope_per_year, trend.slope_u_per_year),
                    {rounded_uncertainty(trend.slope_u_per_year), ""},
                    number_cell(trend.p_value, 2),
                    {trend.meets_limit_on, ""}});
  }
  return figures.add_all(history_plots(unit)) +
         html_table(
             "Trends of " + std::to_string(unit.paths.size()) + " records",
             {"parameter", "newest", "change per year", "u", "p value", "reaches its limit on"},
             rows);
}

}  // namespace

std::string calibration_report(const Calibration& calibration, const ReportOptions& options) {
  Figures figures;
  const auto unit = std::find_if(
      options.history.begin(), options.history.end(),
      [&](const UnitHistory& one) { return one.serial == calibration.sensor.instrument.serial; });
  const bool speaks_against = calibration.findings.status != CalibrationStatus::ok;
  struct Part {
    const char* id;
    const char* title;
    std::string content;
    Fold fold = Fold::closed;
  };
  const std::vector<Part> parts = {
      {"coefficients", "Coefficients", coefficients_matrix(calibration), Fold::never},
      {"story", "The run at a glance", story_section(calibration, options.observations, figures),
       Fold::never},
      {"residuals", "Residuals", residuals_section(calibration, options.observations, figures),
       speaks_against ? Fold::open : Fold::closed},
      {"uncertainty", "Uncertainty", uncertainty_section(calibration, figures)},
      {"levelness", "Levelness", levelness_section(calibration, options.table, figures),
       options.table ? Fold::open : Fold::closed},
      {"temperature", "Temperature", figures.add_all(temperature_plots(calibration))},
      {"turns", "Turns", figures.add_all(turn_plots(calibration))},
      {"noise", "Noise", options.noise != nullptr ? noise_section(*options.noise, figures) : ""},
      {"history", "Drift",
       unit != options.history.end() ? history_section(*unit, figures) : std::string()},
      {"points", "Readings and design points", cube_section(calibration, options.observations)},
      {"parameters", "All parameters", more_coefficients(calibration)},
      {"run", "Instrument and run", run_section(calibration)}};
  std::string links;
  std::string body;
  for (const Part& part : parts) {
    if (!part.content.empty()) {
      links += formatted("<li><a href=\"#{}\">{}</a></li>", part.id, part.title);
      body += section(part.id, part.title, part.content, part.fold);
    }
  }
  const std::string subtitle =
      formatted("{}{}",
                calibration.provenance.date().empty()
                    ? ""
                    : formatted("calibrated {}, ", calibration.provenance.date()),
                calibration.provenance.software);
  return html_page({.title = title_of(calibration),
                    .subtitle = subtitle,
                    .body = formatted("{}<nav aria-label=\"Contents\"><ul>{}</ul></nav>\n{}",
                                      verdict_section(calibration), links, body),
                    .cube = cube_json(calibration)});
}

}  // namespace axiscal
