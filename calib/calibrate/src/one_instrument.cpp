// SPDX-License-Identifier: Apache-2.0
// Checks that all files of a run were recorded with the same instrument.
#include <algorithm>
#include <cmath>
#include <optional>

#include "axiscal/calib/calibrate_run.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "calib/calibrate/fitted_record.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Largest changes that are accepted for one instrument, from day to day and from mount to mount.
// Two instruments of the same batch seldom agree within these limits.
constexpr double largest_size_change = 2e-3;   // relative change of an axis's sensitivity
constexpr double largest_angle_change = 5e-3;  // change of the angle between two axes [rad]
constexpr double largest_bias_change = 5e-2;   // change of a bias, divided by the full response
// A larger change is accepted if it is at most this number of standard errors, because it may be
// noise.
constexpr double clear = 6.0;

// Calibrates one file. Returns nullopt if its readings do not determine a calibration.
std::optional<Calibration> calibration_of(Experiment experiment, const Observations& readings) {
  experiment.fit.search_for_mistakes = false;
  experiment.fit.seats = SeatSetup::none;
  experiment.fit.process.reset();
  experiment.leave_out.clear();  // these run numbers count the readings of all files
  for (const std::optional<Method> method :
       {experiment.fit.method, std::optional<Method>(Method::known)}) {
    try {
      experiment.fit.method = method;
      return fitted_record(experiment, readings);
    } catch (const Error&) {  // e.g. fence faces are missing; method `known` may succeed
      continue;
    }
  }
  return std::nullopt;
}

// Describes the first difference that is too large for one instrument. Returns an empty text if
// there is no such difference.
std::string difference_between(const Calibration& first, const Calibration& other) {
  const SensitivityMatrix& S = first.sensor.response.sensitivity;
  const SensitivityMatrix& T = other.sensor.response.sensitivity;
  const FitStatistics& of_first = *first.fit.statistics;
  const FitStatistics& of_other = *other.fit.statistics;
  const std::vector<std::string>& axes = first.sensor.instrument.axes;
  for (Eigen::Index k = 0; k < S.rows(); ++k) {
    const std::string& axis = axes[static_cast<std::size_t>(k)];
    const double size = S.row(k).norm();
    const double change = T.row(k).norm() - size;
    const double se =
        std::hypot(of_first.sensitivity_se.row(k).norm(), of_other.sensitivity_se.row(k).norm());
    if (std::abs(change) > largest_size_change * size && !(std::abs(change) <= clear * se)) {
      return formatted("the sensitivity of axis {} differs by {} %", axis,
                       number_text(100.0 * std::abs(change) / size, 2));
    }
    const double shift = std::abs(other.sensor.response.bias(k) - first.sensor.response.bias(k));
    const double full = size * first.sensor.field.magnitude;
    const double bias_se = std::hypot(of_first.bias_se(k), of_other.bias_se(k));
    if (shift > largest_bias_change * full && !(shift <= clear * bias_se)) {
      return formatted("the bias of axis {} differs by {} {}", axis, number_text(shift, 2),
                       first.sensor.instrument.unit);
    }
    for (Eigen::Index j = 0; j < k; ++j) {
      const auto angle = [&](const SensitivityMatrix& of) {
        return std::acos(std::clamp(of.row(j).normalized().dot(of.row(k).normalized()), -1.0, 1.0));
      };
      const double turn = std::abs(angle(T) - angle(S));
      const double turn_se = 2.0 * se / size;
      if (turn > largest_angle_change && !(turn <= clear * turn_se)) {
        return formatted("the angle between the axes {} and {} differs by {} degrees",
                         axes[static_cast<std::size_t>(j)], axis,
                         number_text(turn * deg_per_rad, 2));
      }
    }
  }
  return "";
}

}  // namespace

void require_one_instrument(const Experiment& experiment, const Run& run) {
  if (run.rows_of_inputs.size() < 2 || !run.slots.empty()) {
    return;
  }
  std::optional<Calibration> first;
  std::size_t place_of_first = 0;
  std::size_t begin = 0;
  for (std::size_t file = 0; file < run.rows_of_inputs.size(); ++file) {
    std::vector<std::size_t> rows(run.rows_of_inputs[file]);
    for (std::size_t& row : rows) {
      row = begin++;
    }
    const std::optional<Calibration> own =
        calibration_of(experiment, select_rows(run.observations, rows));
    if (!own) {
      continue;
    }
    if (!first) {
      first = own;
      place_of_first = file;
      continue;
    }
    const std::string difference = difference_between(*first, *own);
    if (!difference.empty()) {
      throw RefusedError(
          formatted("{} and {} are from different instruments: {}. All files in one call must be "
                    "from one instrument. Calibrate each file separately. If the files are from "
                    "one instrument, give the serial number of the instrument",
                    run.inputs[place_of_first].path, run.inputs[file].path, difference),
          {settings::each, settings::serial});
    }
  }
}

}  // namespace axiscal
