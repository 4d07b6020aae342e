// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// If the residuals scatter by more than this part of the full response, the cause is probably a
// mistake, not noise.
constexpr double largest_residual_share = 0.02;

// Returns the run numbers of the readings whose robust weight for axis k is 0.
std::set<int> runs_without_weight(const JudgedRun& run, Eigen::Index k) {
  std::set<int> runs;
  for (Eigen::Index i = 0; i < statistics_of(run).robust_weight.rows(); ++i) {
    if (statistics_of(run).robust_weight(i, k) == 0.0) {
      const std::vector<int>& own = statistics_of(run).rows[static_cast<std::size_t>(i)].runs;
      runs.insert(own.begin(), own.end());
    }
  }
  return runs;
}

// Returns true if the level of the field can be set, but the readings have no level column.
bool lacks_level(const JudgedRun& run) {
  const std::vector<FieldDescription>& parts = run.calibration.sensor.field.parts;
  const FieldKind& kind = field_kind(run.calibration.sensor.field.kind);
  const bool can_be_set =
      parts.empty() ? !kind.name.empty() && !kind.local
                    : std::any_of(parts.begin(), parts.end(),
                                  [](const FieldDescription& part) { return part.set_by_level; });
  return can_be_set && run.calibration.sensor.field.in_table &&
         !run.calibration.fit.residuals.empty() && !run.calibration.fit.residuals.front().level;
}

// Returns further possible causes of large residuals for this kind of field and instrument.
std::string other_reasons(const JudgedRun& run) {
  const InstrumentKind& kind = find_instrument_kind(run.calibration.sensor.instrument.kind);
  std::string reasons;
  if (lacks_level(run)) {
    reasons +=
        "; if the field was set to several values, add the column 'level' (the multiple of "
        "the stated field)";
  }
  if (kind.sees_one_side && !run.calibration.sensor.instrument.one_sided) {
    reasons +=
        "; if the photodiodes measure only light from their front, declare them as "
        "one-sided";
  }
  if (kind.answers_to_gravity && run.calibration.sensor.also.empty()) {
    reasons += "; if the instrument responds to gravity, give gravity as a second field ('also')";
  }
  return reasons;
}

// Tests the differences between the measured and the true magnitude of the field. If the
// orientations of the readings are unknown, the fit has no other residuals.
void find_poor_magnitude(const JudgedRun& run, Warnings& found) {
  double error =
      run.calibration.fit.orientations ? run.calibration.fit.orientations->fit_error : 0.0;
  if (run.calibration.fit.robust) {  // readings of robust weight 0 are not counted
    error = statistics_of(run).residual_sd.maxCoeff() / full_response(run, 0);
  }
  // If the error is above this limit, the instrument was moving, or the field was not uniform.
  constexpr double hopeless = 0.1;
  if (error > hopeless) {
    found.add(
        WarningCode::no_fit, {},
        formatted(
            "the measured magnitude differs from the field's magnitude by {} % (rms), so the "
            "sensitivities are unreliable: the instrument was moving during the readings, or the "
            "field differs from place to place, as is usual indoors; take the readings again at "
            "rest{}",
            number_text(100.0 * error, 2),
            run.calibration.fit.robust ? "" : ", or use robust weights if few readings are wrong"));
  } else if (error > largest_residual_share) {
    found.add(WarningCode::poor_fit, {},
              formatted("the measured magnitude differs from the field's magnitude by {} % (rms): "
                        "the instrument was moving during the readings, iron nearby disturbs the "
                        "field, or the noise is large; {}take the readings again at rest",
                        number_text(100.0 * error, 2),
                        run.calibration.fit.robust ? "" : "try robust weights, or "));
  }
}

// Tests the residual standard deviation of the fit and the rms residual of the readings. The first
// alone is not enough: method `paired` fits averages of readings, which can hide a mistake.
void find_poor_fit(const JudgedRun& run, Warnings& found) {
  if (run.mistakes.culprit) {
    return;
  }
  if (by_magnitude(run)) {
    find_poor_magnitude(run, found);
    return;
  }
  for (Eigen::Index k = 0; k < run.calibration.sensor.response.bias.size(); ++k) {
    const std::set<int> rejected = runs_without_weight(run, k);
    const auto counts = [&](const ReadingResidual& residual) {
      return residual.used && !std::isnan(residual.response(k)) && !rejected.contains(residual.run);
    };
    double squares = 0.0;
    double largest = 0.0;
    std::size_t count = 0;
    for (const ReadingResidual& residual : run.calibration.fit.residuals) {
      if (counts(residual)) {
        squares += residual.response(k) * residual.response(k);
        largest = std::max(largest, std::abs(residual.response(k)));
        ++count;
      }
    }
    if (count < 2 * rejected.size()) {
      found.add(
          WarningCode::no_fit, {rejected.begin(), rejected.end()},
          formatted("axis {}: robust regression gives weight 0 to {} of {} readings, which is too "
                    "many to identify the wrong readings: look for wrong labels or units",
                    axis_name(run, k), rejected.size(), count + rejected.size()));
      continue;
    }
    if (!determines_main_sensitivity(run, k)) {
      continue;  // the full response is unknown
    }
    const double rms = std::sqrt(squares / static_cast<double>(count));
    const double share = std::fmax(statistics_of(run).residual_sd(k), rms) / full_response(run, k);
    if (!(share > largest_residual_share)) {
      continue;
    }
    std::vector<int> runs;
    for (const ReadingResidual& residual : run.calibration.fit.residuals) {
      if (counts(residual) && std::abs(residual.response(k)) > 0.5 * largest) {
        runs.push_back(residual.run);
      }
    }
    // Above this share, the whole fit is unreliable.
    constexpr double hopeless = 0.2;
    found.add(
        share > hopeless ? WarningCode::no_fit : WarningCode::poor_fit, runs,
        formatted("axis {}: the residuals are {} % of the full response, the largest at {}; a "
                  "reading may have a wrong design point, two readings may be exchanged, or the "
                  "noise is large: correct the labels or take these readings again{}",
                  axis_name(run, k), number_text(100.0 * share, 2), name_of_runs(runs),
                  other_reasons(run)));
  }
}

}  // namespace

WarningRule poor_fit_rule() {
  return {.name = "poor_fit", .find = find_poor_fit};
}

}  // namespace axiscal
