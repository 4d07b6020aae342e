// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/session_end.hpp"

#include "acquisition/src/session_words.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/forecast.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// A reading is noisy if its scatter is more than this multiple of the readings' median scatter.
constexpr double noisy_reading = 5.0;

// Returns the method that calibrate() will use.
Method method_of(const Experiment& experiment, const std::vector<RunSheetRow>& sheet) {
  Observations planned;
  planned.readings = readings_of(sheet);
  return experiment.fit.method.value_or(choose_method(experiment, planned));
}

std::string verdict_text(const Calibration& calibration) {
  switch (calibration.findings.status) {
    case CalibrationStatus::ok:
      return "calibrated";
    case CalibrationStatus::warning:
      return "calibrated, with warnings";
    case CalibrationStatus::refused:
      break;
  }
  return "refused";
}

}  // namespace

std::optional<double> expected_angle_u_deg(const Experiment& experiment,
                                           const std::vector<SessionStep>& steps,
                                           const SensorModel& nominal,
                                           double noise_sd) {
  ForecastSetup setup;
  setup.nominal = nominal;
  setup.noise_sd = noise_sd;
  setup.positioner = experiment.positioner;
  std::vector<RunSheetRow> sheet;
  for (const SessionStep& step : steps) {
    if (!step.skipped) {
      setup.design.push_back(step.row.entry);
      sheet.push_back(step.row);
    }
  }
  setup.method = method_of(experiment, sheet);
  try {
    const Forecast result = forecast(setup);
    return deg_per_rad * largest_angle_uncertainty(result, result.covariance());
  } catch (const Error&) {
    return {};
  }
}

SessionReview review_session(const std::vector<Calibration>& calibrations,
                             const std::string& why_none,
                             const std::vector<CapturedReading>& readings,
                             const std::set<int>& suspects) {
  SessionReview review;
  std::set<int> runs = suspects;
  for (const Calibration& calibration : calibrations) {
    const std::string& slot = calibration.provenance.slot;
    const std::string of = calibrations.size() > 1 ? formatted("slot {}: ", slot) : "";
    review.lines.push_back(of + verdict_text(calibration));
    for (const CalibrationWarning& warning : calibration.findings.warnings) {
      review.lines.push_back(of + warning.message);
    }
    if (calibration.findings.suggestion) {
      runs.insert(calibration.findings.suggestion->runs.begin(),
                  calibration.findings.suggestion->runs.end());
    }
  }
  if (calibrations.empty()) {
    review.lines.push_back("no calibration: " + why_none);
  }
  std::vector<double> scatter;
  for (const CapturedReading& reading : readings) {
    scatter.push_back(reading.sd.norm());
  }
  const double usual = scatter.empty() ? 0.0 : upper_median(scatter);
  for (const CapturedReading& reading : readings) {
    if (usual > 0.0 && reading.sd.norm() > noisy_reading * usual) {
      runs.insert(reading.run);
      review.lines.push_back(
          formatted("the scatter of {} is {} times the median scatter of all "
                    "readings",
                    run_text(reading.run), number_text(reading.sd.norm() / usual, 2)));
    }
  }
  review.again.assign(runs.begin(), runs.end());
  if (!runs.empty()) {
    std::vector<std::string> names;
    for (const int run : runs) {
      names.push_back(std::to_string(run));
    }
    review.lines.push_back("runs to take again: " + joined(names));
  }
  return review;
}

}  // namespace axiscal
