// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/remarks.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/positioner/design.hpp"
#include "calib/fit/reading_step.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void note_field_uncertainty(Calibration& calibration) {
  const FieldDescription& field = calibration.sensor.field;
  if (!(field.magnitude_u > 0.0)) {
    return;
  }
  const std::string percent = number_text(100.0 * field.magnitude_u / field.magnitude, 3);
  const std::string share =
      field.parts.empty() ? formatted(" ({} % of every sensitivity)", percent) : "";
  calibration.findings.notes.push_back(
      {NoteCode::field,
       formatted("the standard uncertainty of the field's magnitude is {} {}{}{}; the expanded "
                 "uncertainties include this uncertainty, but the standard errors of the fit do "
                 "not",
                 number_text(field.magnitude_u), field.unit,
                 field.model.empty() ? "" : ", model " + field.model, share)});
}

// Adds a note for each axis on readings to which robust regression gave weight 0. The note names at
// most five readings, and states the number of the others.
void note_readings_without_weight(Calibration& calibration) {
  const FitStatistics& statistics = *calibration.fit.statistics;
  if (statistics.robust_weight.size() == 0) {
    return;
  }
  for (std::size_t k = 0; k < calibration.sensor.instrument.axes.size(); ++k) {
    constexpr std::size_t most_named = 5;
    std::vector<int> named;
    std::size_t count = 0;
    for (std::size_t i = 0; i < statistics.rows.size(); ++i) {
      const double weight =
          statistics.robust_weight(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      if (weight == 0.0) {
        ++count;
        if (count <= most_named) {
          const std::vector<int>& runs = statistics.rows[i].runs;
          named.insert(named.end(), runs.begin(), runs.end());
        }
      }
    }
    if (count > 0) {
      calibration.findings.notes.push_back(
          {NoteCode::weights,
           formatted("{}{}: robust regression ignores the readings of axis {} (weight 0)",
                     name_of_runs(named),
                     count > most_named ? formatted(" and {} more", count - most_named) : "",
                     calibration.sensor.instrument.axes[k])});
    }
  }
}

// For method `paired`, adds a note if the averages of opposite readings leave fewer than 5 degrees
// of freedom and method `joint` would leave more than twice as many.
void note_few_averages(Calibration& calibration) {
  constexpr double few = 5.0;
  const FitStatistics& statistics = *calibration.fit.statistics;
  const auto m = static_cast<double>(calibration.sensor.response.bias.size());
  const double own = statistics.degrees_of_freedom(0);
  const double joint = statistics.observations -
                       static_cast<double>(statistics.covariance.rows()) / m -
                       (calibration.fit.conditions.blocks - 1.0) - 2.0 / m;
  if (method_kind(calibration.fit.method).averages_pairs && own > 0.0 && own < few &&
      joint > 2.0 * own) {
    calibration.findings.notes.push_back(
        {NoteCode::method,
         formatted("the averages of opposite positions leave few degrees of freedom ({}). The "
                   "method 'joint' gives nearly the same estimates with more degrees of freedom "
                   "(about {}) and shorter intervals",
                   number_text(own, 2), number_text(joint, 2))});
  }
}

// Adds a note if the design points were taken in the order of the standard design, or in the same
// order in each block. A periodic disturbance, for example from a heater, can then change the
// coefficients without being noticed.
void note_fixed_order(const Observations& observations, Calibration& calibration) {
  std::map<int, std::vector<DesignPoint>> blocks;
  for (const Reading& reading : observations.readings) {
    if (!reading.point) {
      return;
    }
    blocks[reading.block].push_back(*reading.point);
  }
  const std::vector<DesignPoint>& first = blocks.begin()->second;
  constexpr std::size_t fewest = 12;
  if (first.size() < fewest) {
    return;
  }
  const std::vector<DesignEntry> design = standard_design(12);
  const bool by_design = std::equal(
      design.begin(), design.end(), first.begin(),
      [](const DesignEntry& entry, const DesignPoint& point) { return entry.point == point; });
  const bool repeats =
      blocks.size() > 1 && std::all_of(blocks.begin(), blocks.end(),
                                       [&](const auto& one) { return one.second == first; });
  if (by_design || repeats) {
    calibration.findings.notes.push_back(
        {NoteCode::conditions,
         formatted("the readings were taken {}: a periodic disturbance can change the coefficients "
                   "unnoticed; in random order, the disturbance appears as noise",
                   repeats ? "in the same order in each block" : "in the order of the design")});
  }
}

void note_conditions(Calibration& calibration) {
  const bool by_table = method_kind(calibration.fit.method).by_pose;
  if (by_table && !calibration.fit.conditions.intermediate && !calibration.fit.residuals.empty() &&
      calibration.fit.statistics->degrees_of_freedom.minCoeff() > 0.0) {
    calibration.findings.notes.push_back(
        {NoteCode::conditions,
         "The uncertainties include only repeatability. Take three or four blocks to include "
         "changes from day to day and from set-up to set-up"});
  }
}

}  // namespace

void add_notes(Calibration& calibration,
               const Observations& observations,
               const Positioner& positioner) {
  const auto m = calibration.sensor.response.bias.size();
  if (m < 3) {
    calibration.findings.notes.push_back(
        {NoteCode::axes,
         "with fewer than three axes, a reading gives only the field along each axis (if the field "
         "is gravity, also the angle of the axis to the horizontal), not the field vector"});
  }
  note_readings_without_weight(calibration);
  note_few_averages(calibration);
  note_conditions(calibration);
  note_fixed_order(observations, calibration);
  std::set<DesignPoint> rocking;  // design points at which the cube rocks; usually empty
  for (const Reading& reading : observations.readings) {
    if (reading.point && positioner.seat(*reading.point).rocks) {
      rocking.insert(*reading.point);
    }
  }
  for (std::string& remark : rocking_remarks(positioner, rocking)) {
    calibration.findings.notes.push_back({NoteCode::seats, std::move(remark)});
  }
  std::vector<int> runs;
  runs.reserve(observations.readings.size());
  for (const Reading& reading : observations.readings) {
    runs.push_back(reading.run);
  }
  std::sort(runs.begin(), runs.end());
  if (std::adjacent_find(runs.begin(), runs.end()) != runs.end()) {
    calibration.findings.notes.push_back(
        {NoteCode::input,
         "some readings have the same run number, so messages with this number are ambiguous"});
  }
  note_field_uncertainty(calibration);
}

void note_stated_inputs(double resolution, const ReadingSet& set, Calibration& calibration) {
  std::vector<CalibrationNote>& notes = calibration.findings.notes;
  if (std::string missing = not_counted_sentence(calibration); !missing.empty()) {
    notes.push_back({NoteCode::not_counted, std::move(missing)});
  }
  double finest = resolution;
  for (Eigen::Index k = 0; k < set.axis_count() && resolution > 0.0; ++k) {
    const double noise = calibration.fit.statistics->residual_sd(k);
    finest = std::min(
        finest,
        detect_rounding_step(set.readings_of_axis(k), resolution, noise).value_or(resolution));
  }
  if (finest < 0.5 * resolution) {
    notes.push_back({NoteCode::stated,
                     formatted("The stated resolution is {} {}, but the readings have steps of {}. "
                               "The uncertainties may be too large",
                               number_text(resolution, 3), calibration.sensor.instrument.unit,
                               number_text(finest, 3))});
  }
  const std::optional<FieldSizeCheck>& size = calibration.fit.field_size;
  constexpr double too_small = 0.995;
  if (size && size->by_inputs > size->by_noise && size->p_value > too_small) {
    constexpr double ppm = 1e6;
    notes.push_back(
        {NoteCode::stated,
         formatted("The measured magnitude of the field scatters over the orientations by {} ppm, "
                   "but the stated uncertainties of cube and table predict {} ppm. These "
                   "uncertainties may be too large",
                   number_text(size->relative_sd * ppm, 2),
                   number_text(size->by_inputs * ppm, 2))});
  }
}

void note_weights(const Experiment& experiment,
                  const Observations& observations,
                  Calibration& calibration) {
  const Weighting weights = calibration.fit.weights;
  if (!experiment.fit.weighting && weights == Weighting::samples && observations.samples &&
      observations.samples->minCoeff() < observations.samples->maxCoeff()) {
    calibration.findings.notes.push_back(
        {NoteCode::weights,
         "readings are weighted by their numbers of samples; the weighting 'none' gives all "
         "readings the same weight"});
  }
  if (weights == Weighting::sd && observations.response_sd) {
    std::vector<int> runs;
    for (Eigen::Index i = 0; i < observations.size(); ++i) {
      if ((observations.response_sd->row(i).array() == 0.0).any()) {
        runs.push_back(observations.readings[static_cast<std::size_t>(i)].run);
      }
    }
    if (!runs.empty()) {
      calibration.findings.notes.push_back(
          {NoteCode::weights,
           formatted("{}: a standard deviation is 0; it is replaced by the median of the axis's "
                     "standard deviations",
                     name_of_runs(runs))});
    }
  }
}

void remark_on_magnitude(const Experiment& experiment, Calibration& calibration) {
  const FieldDescription& found = calibration.sensor.field;
  for (const FieldDescription& part : found.as_parts()) {
    const FieldKind& kind = field_kind(part.kind);
    // An instrument with two axes that was rotated only in a plane measures only the field's
    // component in this plane.
    const bool is_in_plane = method_kind(calibration.fit.method).by_magnitude &&
                             calibration.sensor.instrument.axis_count() == 2;
    if (!part.free_length && !is_in_plane &&
        !is_possible_magnitude(kind, part.magnitude, part.unit)) {
      calibration.findings.warnings.push_back(
          {.code = WarningCode::impossible_field,
           .runs = {},
           .message =
               formatted("the magnitude of field {} is stated as {} {}, but on the Earth it is {}; "
                         "correct the magnitude or the unit, or use the field 'custom' for another "
                         "field",
                         part.kind, number_text(part.magnitude, 6), part.unit,
                         possible_magnitudes(kind, part.unit))});
    }
  }
  const FieldSetup& field = experiment.field;
  if (field.others.empty() && field.unit.empty() && field.magnitude && field.of &&
      !field_kind(found.kind).units.empty() && found.unit != field_kind(found.kind).units.front()) {
    calibration.findings.notes.push_back(
        {NoteCode::field, formatted("the field's magnitude {} is stated without a unit; the unit "
                                    "is assumed to be {}, because this value is impossible in {}",
                                    number_text(*field.magnitude), found.unit,
                                    field_kind(found.kind).units.front())});
  }
  const bool is_relative = field.others.empty() && field.kind() == "custom" && !field.magnitude &&
                           !field.in_table && found.unit == "1";
  if (is_relative &&
      find_instrument_kind(calibration.sensor.instrument.kind).relative_field_will_do) {
    calibration.findings.notes.push_back(
        {NoteCode::field,
         "neither the magnitude of the field nor the site is given, so the magnitude is taken as "
         "1: directions are correct, but magnitudes are relative to the field"});
  }
}

void note_meaning_of_magnitude(const Experiment& experiment, Calibration& calibration) {
  const FieldSetup& field = experiment.field;
  if (!field.in_table || field.magnitude || !field.others.empty()) {
    return;
  }
  const double length = field.in_table->norm();
  const bool is_one_g = field_kind(field.kind()).vertical && calibration.sensor.field.unit == "g";
  const std::string what = formatted(
      "the field's magnitude is taken as the length of the given vector ('in_table'), {} "
      "{}",
      number_text(length, 5), calibration.sensor.field.unit);
  if (is_one_g && std::abs(length - 1.0) > 1e-6) {
    calibration.findings.warnings.push_back(
        {.code = WarningCode::field_length,
         .runs = {},
         .message = what + ", not 1 g; if the vector is only a direction, set the magnitude to 1"});
  } else if (length != 1.0) {
    calibration.findings.notes.push_back({NoteCode::field, what});
  }
}

void warn_of_other_sensitivity(const Experiment& experiment, Calibration& calibration) {
  const std::optional<double> expected =
      expected_sensitivity(experiment, calibration.sensor.field.unit);
  if (!expected) {
    return;
  }
  constexpr double far_off = 0.3;
  constexpr double off_its_unit = 0.1;
  const bool by_unit = !experiment.nominal_sensitivity;
  for (Eigen::Index k = 0; k < calibration.sensor.response.bias.size(); ++k) {
    const double ratio =
        calibration.sensor.response.sensitivity.row(k).norm() / std::abs(*expected);
    const double off = std::abs(ratio - 1.0);
    // Some partial designs do not determine the sensitivity of an axis to the field's component
    // along its nominal direction.
    const std::optional<int> own = nominal_axis(calibration.sensor.instrument, k);
    const bool is_seen = !own || !calibration.fit.statistics ||
                         !std::isnan(calibration.fit.statistics->sensitivity_se(k, *own));
    if (off <= (by_unit ? off_its_unit : far_off) || !is_seen) {
      continue;
    }
    std::string reason;
    for (const auto& [factor, text] : std::initializer_list<std::pair<double, const char*>>{
             {1e3, "1000"}, {standard_gravity, "9.80665"}}) {
      for (const double one : {factor, 1.0 / factor}) {
        if (std::abs(ratio / one - 1.0) <= far_off) {
          reason = formatted(": a factor of {}{}, so the readings or the field are in another unit",
                             one > 1.0 ? "" : "1/", text);
        }
      }
    }
    const WarningCode code = by_unit && off > far_off ? WarningCode::reading_unit
                             : reason.empty()         ? WarningCode::sensitivity
                                                      : WarningCode::unit_factor;
    const std::string nominal = by_unit ? formatted("the expected sensitivity of readings in {}",
                                                    calibration.sensor.instrument.unit)
                                        : "the nominal sensitivity";
    calibration.findings.warnings.push_back(
        {.code = code,
         .runs = {},
         .message = formatted(
             "axis {}: its sensitivity is {} times {}{}; check unit, range and wiring{}",
             calibration.sensor.instrument.axes[static_cast<std::size_t>(k)], number_text(ratio, 3),
             nominal, reason, by_unit ? ", or give the right nominal sensitivity" : "")});
  }
}

}  // namespace axiscal
