// SPDX-License-Identifier: Apache-2.0
#include "report/src/verdict_section.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "axiscal/calib/summary.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/report/calibration_report.hpp"
#include "axiscal/report/run_sheet_page.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"

namespace axiscal {
namespace {

std::string what_it_is_fit_for(const Calibration& calibration) {
  if (calibration.sensor.instrument.axis_count() < 3) {
    return "The instrument has fewer than three axes. A reading gives the field along each axis. "
           "The command 'apply' computes the uncertainty of this field.";
  }
  const WorstAngleUncertainty worst = worst_angle_uncertainty(calibration);
  if (!std::isfinite(worst.expanded_deg)) {
    return "The record does not state uncertainties, so the accuracy of the calibration is "
           "unknown.";
  }
  const bool is_direction = worst.quantity == "direction of the field";
  return formatted(
      "The uncertainty of {} from one reading is at most {} degrees (95 %) in any attitude {}{}",
      is_direction ? "the direction of the field" : "pitch and roll", rounded(worst.expanded_deg),
      is_direction
          ? "of the instrument"
          : formatted("with a pitch of up to 80 degrees; it is largest for {}", worst.quantity),
      calibration.sensor.temperature ? ". This applies at the reference temperature." : ".");
}

// Returns the warnings of a calibration, and the conditions under which the calibration is valid.
// @param said  text of a warning that is already on the page; it is left out.
std::vector<std::string> what_to_watch(const Calibration& calibration, const std::string& said) {
  std::vector<std::string> lines;
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    if (warning.message != said) {
      lines.push_back(warning.message);
    }
  }
  if (calibration.findings.confirmation && !calibration.findings.confirmation->passed) {
    lines.push_back(confirmation_sentence(calibration));
  }
  if (calibration.sensor.temperature) {
    const TemperatureResponse& over = *calibration.sensor.temperature;
    lines.push_back(formatted(
        "The calibration is valid at temperatures from {}; outside this range, results are marked "
        "as extrapolated.",
        span_text(over, calibration.sensor.instrument.axes, [](const TemperatureSpan& span) {
          return formatted("{} to {}", rounded(span.low, 5), rounded(span.high, 5));
        })));
  } else if (calibration.fit.statistics && calibration.status() != CalibrationStatus::refused) {
    lines.emplace_back(
        "The calibration is valid only at the temperature of its readings. The effect of "
        "temperature is unknown.");
  }
  if (std::string missing = not_counted_sentence(calibration); !missing.empty()) {
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

// ---- Comparison of the stated pose with the probable pose ----

const ReadingResidual* residual_of(const Calibration& calibration, int run) {
  const auto at = std::find_if(calibration.fit.residuals.begin(), calibration.fit.residuals.end(),
                               [&](const ReadingResidual& one) { return one.run == run; });
  return at == calibration.fit.residuals.end() ? nullptr : &*at;
}

// Returns the run number of each suspect reading and the design point at which the reading was
// probably taken.
std::vector<std::pair<int, DesignPoint>> probable_points(const Calibration& calibration) {
  const Correction& suggestion = *calibration.findings.suggestion;
  std::vector<std::pair<int, DesignPoint>> points = suggestion.points;
  // If two readings were exchanged, each was probably taken at the design point stated for the
  // other.
  if (points.empty() && suggestion.code == WarningCode::exchanged && suggestion.runs.size() == 2) {
    for (const std::size_t i : {0U, 1U}) {
      const ReadingResidual* const other = residual_of(calibration, suggestion.runs[1 - i]);
      if (other != nullptr && other->point) {
        points.emplace_back(suggestion.runs[i], *other->point);
      }
    }
  }
  return points;
}

std::string pose_words(const DesignPoint& point) {
  return formatted("{} on the table, {} at the fence", typographic_face(face_name(point.rest())),
                   typographic_face(face_name(point.fence())));
}

// Returns a table of the probable values of wrong readings.
std::string values_table(const Calibration& calibration) {
  const Correction& suggestion = *calibration.findings.suggestion;
  std::vector<std::vector<Cell>> rows;
  for (const auto& [run, response] : suggestion.responses) {
    rows.push_back({{formatted("run {}", run), ""}});
    for (Eigen::Index k = 0; k < response.size(); ++k) {
      rows.back().push_back(number_cell(response(k), 6));
    }
  }
  std::vector<std::string> head = {"reading"};
  for (const std::string& axis : calibration.sensor.instrument.axes) {
    head.push_back(formatted("{} [{}]", axis, calibration.sensor.instrument.unit));
  }
  return rows.empty() ? "" : html_table("Probable values", head, rows);
}

std::string as_it_probably_was(const Calibration& calibration) {
  if (!calibration.findings.suggestion) {
    return "";
  }
  constexpr std::size_t most = 4;
  std::string html;
  const std::vector<std::pair<int, DesignPoint>> points = probable_points(calibration);
  for (std::size_t i = 0; i < std::min(points.size(), most); ++i) {
    const auto& [run, point] = points[i];
    const ReadingResidual* const labelled = residual_of(calibration, run);
    if (labelled == nullptr || !labelled->point) {
      continue;
    }
    html += formatted(
        "<figure class=\"lay\"><figcaption>Run {}</figcaption><div class=\"pair\"><div>{}<p>As "
        "labelled: {}</p></div><div>{}<p>As it probably lay: {}</p></div></div></figure>\n",
        run, seat_svg(*labelled->point), escaped(pose_words(*labelled->point)), seat_svg(point),
        escaped(pose_words(point)));
  }
  if (points.size() > most) {
    html += paragraph(formatted("The warning names {} more readings.", points.size() - most));
  }
  return points.empty() ? values_table(calibration)
                        : formatted("<div class=\"lays\">{}</div>\n", html);
}

}  // namespace

std::string verdict_section(const Calibration& calibration) {
  // The state determines the colour of the verdict. Missing statistics change `ok` to `warning`. A
  // failed limit or confirmation reading changes the state to `refused`.
  std::string state(status_name(calibration.findings.status));
  if (state == "ok" && !calibration.fit.statistics) {
    state = "warning";
  }
  if ((calibration.findings.verdict && !calibration.findings.verdict->passed) ||
      (calibration.findings.confirmation && !calibration.findings.confirmation->passed)) {
    state = "refused";
  }
  const std::string headline = verdict_sentence(calibration);
  std::string html = formatted("<div class=\"verdict {}\" role=\"status\"><strong>{}</strong>\n",
                               state, escaped(headline));
  std::string likely;
  if (state == "refused" && calibration.findings.suggestion) {
    likely = calibration.findings.suggestion->message;
  } else if (state == "refused" && !calibration.findings.warnings.empty()) {
    likely = calibration.findings.warnings.front().message;
  }
  html += likely.empty() ? "" : paragraph("Most likely: " + likely);
  if (calibration.findings.status != CalibrationStatus::refused) {
    html += paragraph(what_it_is_fit_for(calibration));
  }
  const std::vector<std::string> watch = what_to_watch(calibration, likely);
  if (!watch.empty()) {
    html += paragraph("Please note:") + bullets(watch);
  }
  html += "</div>\n" + as_it_probably_was(calibration);
  return html + (calibration.findings.verdict ? limits_table(*calibration.findings.verdict) : "");
}

}  // namespace axiscal
