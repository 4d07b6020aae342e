// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/run_checks.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/field/settings.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/instruments/settings.hpp"
#include "calib/calibrate/src/method_choice.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns true if the field is a single local field, so that its level cannot be set.
bool is_local(const FieldSetup& field) {
  return field.others.empty() && field_kind(field.kind()).local;
}

// Checks that each column level.NAME refers to an existing part NAME of the field.
void check_level_names(const Experiment& experiment, const Observations& observations) {
  std::set<std::string> stated;
  for (const Reading& reading : observations.readings) {
    for (const auto& [name, level] : reading.level.of_parts()) {
      stated.insert(name);
    }
  }
  std::vector<std::string> names;
  for (const FieldSetup* const part : experiment.field.parts()) {
    if (part->is_induced()) {
      names.emplace_back(part->name.empty() ? part->kind() : part->name);
    }
  }
  for (const std::string& name : stated) {
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      throw SetupError(
          formatted("column 'level.{}': no part of the field with the role 'induced' has this "
                    "name{}",
                    name, names.empty() ? "" : "; these parts are " + joined(names)),
          {settings::field});
    }
  }
}

void check_range(const Instrument& instrument) {
  if (instrument.range && !(instrument.range->low < instrument.range->high)) {
    throw SetupError("the instrument's range: the low end must be less than the high end",
                     {settings::range});
  }
}

void check_instrument(const Instrument& instrument) {
  if (instrument.kind.empty()) {
    throw SetupError("the kind of instrument is missing: give accelerometer, magnetometer, ...",
                     {settings::instrument});
  }
  static_cast<void>(find_instrument_kind(instrument.kind));
  check_range(instrument);
  try {
    check_axes(instrument);
  } catch (const DomainError& error) {
    throw SetupError(error.what(), error.settings());
  }
}

void check_sizes(const Instrument& instrument, const Observations& observations) {
  if (observations.response.rows() != observations.size() ||
      observations.response.cols() != instrument.axis_count() ||
      !observations.response.allFinite()) {
    throw DomainError(
        "calibrate: the responses must be finite, with a row for each reading and a "
        "column for each axis");
  }
  const bool bad_samples =
      observations.samples && (observations.samples->size() != observations.size() ||
                               !(observations.samples->array() > 0.0).all());
  const bool bad_sd = observations.response_sd &&
                      (observations.response_sd->rows() != observations.response.rows() ||
                       observations.response_sd->cols() != observations.response.cols());
  if (bad_samples || bad_sd) {
    throw DomainError(
        "calibrate: each reading must have a positive number of samples, and the standard "
        "deviations must have the same size as the responses");
  }
}

void check_values(const Observations& observations) {
  // The squares of larger numbers overflow. No instrument has such readings.
  constexpr double largest = 1e150;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    if (!(observations.response.row(static_cast<Eigen::Index>(i)).cwiseAbs().maxCoeff() <
          largest) ||
        (reading.field_in_sensor && !(reading.field_in_sensor->cwiseAbs().maxCoeff() < largest))) {
      throw RefusedError(
          formatted("run {}: a value of 1e150 or more is not a reading; correct it or leave it out",
                    reading.run));
    }
  }
}

void check_readings(const Experiment& experiment, const Observations& observations) {
  for (const Reading& reading : observations.readings) {
    const Reading& first = observations.readings.front();
    if (reading.point.has_value() != first.point.has_value() ||
        reading.field_in_sensor.has_value() != first.field_in_sensor.has_value() ||
        (!reading.point && !reading.field_in_sensor &&
         method_kind(experiment.fit.method).by_pose)) {
      throw DomainError(
          "calibrate: either all readings must have a design point, or all readings "
          "must have a field");
    }
    if (reading.level != 1.0 && is_local(experiment.field)) {
      throw RefusedError(
          formatted("run {}: the level is {}, but {} cannot be set, so its level is "
                    "always 1",
                    reading.run, reading.level.text(),
                    field_kind(experiment.field.kind()).vertical ? experiment.field.kind()
                                                                 : "a local field"));
    }
  }
}

// Checks readings without fence faces. They are allowed only if the field is parallel to the normal
// of a level table.
void check_without_fence(const Experiment& experiment, Method method) {
  constexpr const char* advice = "add the column 'fence' (the face at the fence)";
  if (!method_kind(method).directions_known) {
    throw RefusedError(formatted("method '{}': the readings do not state the face at the fence; "
                                 "{}. If the table is level and the field is perpendicular to the "
                                 "table, the method 'known' does not need this column",
                                 method_name(method), advice),
                       {settings::method});
  }
  if (!experiment.table.slope.isZero(0.0)) {
    throw SetupError(formatted("a slope of the table is given, but the readings do not state the "
                               "face at the fence; {}",
                               advice),
                     {settings::slope});
  }
  for (const FieldDescription& part : resolve_field(experiment)) {
    constexpr double upright = 1e-9;
    if (part.in_table && part.in_table->head<2>().norm() > upright * part.in_table->norm()) {
      throw RefusedError(
          formatted("field {} is not perpendicular to the table, so the readings must state the "
                    "face at the fence: {}",
                    part.kind, advice));
    }
  }
}

void check_levels(const Observations& observations, Method method) {
  for (const Reading& reading : observations.readings) {
    if (method_kind(method).by_magnitude && reading.level != 1.0) {
      throw RefusedError(
          formatted("run {}: the level is {}, but the method 'magnitude' requires the same "
                    "magnitude of the field in all readings",
                    reading.run, reading.level.text()));
    }
  }
}

}  // namespace

void check_run(const Experiment& experiment, const Observations& observations) {
  const Instrument& instrument = experiment.instrument;
  check_instrument(instrument);
  check_sizes(instrument, observations);
  if (experiment.fit.noise_ratio.size() > 0 &&
      (experiment.fit.noise_ratio.size() != instrument.axis_count() ||
       !(experiment.fit.noise_ratio.array() > 0.0).all())) {
    throw SetupError("the noise ratio must have a positive number for each axis");
  }
  check_values(observations);
  check_level_names(experiment, observations);
  check_readings(experiment, observations);
  if (!is_rotation(experiment.rotation_sensor_from_positioner)) {
    throw DomainError("calibrate: rotation_sensor_from_positioner is not a rotation");
  }
}

void check_temperature(const Experiment& experiment,
                       const std::vector<Reading>& readings,
                       Method method) {
  const TemperatureSetup& setup = experiment.fit.temperature;
  if (setup.order == 0 && !setup.automatic) {
    return;
  }
  if (setup.order < 0 || (setup.order > 2 && method_kind(method).fits_sensitivity)) {
    throw SetupError(
        formatted("temperature order {}: must be 0, 1 or 2 (the method 'bias' accepts any order)",
                  setup.order));
  }
  for (const Reading& reading : readings) {
    if (!reading.temperature) {
      throw RefusedError(formatted(
          "temperature terms need the column 'temperature'; run {} lacks a value", reading.run));
    }
  }
}

void check_method(const Experiment& experiment,
                  const Observations& observations,
                  const Observations& used,
                  Method method,
                  bool by_field) {
  const std::string name(method_name(method));
  if (!by_field && !method_kind(method).by_magnitude && method_kind(method).fits_sensitivity &&
      !has_labels(observations)) {
    throw RefusedError(
        formatted(
            "method '{}': the readings lack design points. Add the columns 'rest' and 'fence', use "
            "the method 'magnitude', or use the method 'known' with the columns 'fx', 'fy', 'fz'",
            name),
        {settings::method});
  }
  if (!observations.has_fence && has_labels(observations) && method_kind(method).fits_sensitivity) {
    check_without_fence(experiment, method);
  }
  const bool has_one_slope =
      method_kind(method).directions_known || method_kind(method).by_magnitude;
  if (has_one_slope && experiment.fit.level_by == LevelBy::block) {
    throw SetupError(
        formatted("the method '{}' does not estimate the slope of the table; one slope for each "
                  "block ('level_by') requires the method 'paired' or 'joint'",
                  name));
  }
  if (experiment.fit.robust && !method_kind(method).fits_sensitivity) {
    throw SetupError("the method 'bias' does not support robust regression; leave out 'robust'");
  }
  if (!experiment.field.others.empty() &&
      (method_kind(method).averages_pairs || method_kind(method).by_magnitude ||
       experiment.fit.level_by == LevelBy::block)) {
    throw SetupError(
        "a field of several parts requires the method 'joint' or 'known', and cannot be combined "
        "with one slope of the table for each block ('level_by')");
  }
  for (std::size_t i = 1; i < experiment.also.size(); ++i) {
    if (experiment.also[i].kind() == experiment.also.front().kind()) {
      throw SetupError(formatted("second field ('also') {}: this field is given twice",
                                 experiment.also[i].kind()));
    }
  }
  if (!experiment.also.empty() && (by_field || method_kind(method).by_magnitude)) {
    throw SetupError(
        "a second field ('also') requires design points, and the method 'paired', 'joint' or "
        "'known'");
  }
  if (experiment.instrument.one_sided &&
      (method_kind(method).averages_pairs || method_kind(method).by_magnitude)) {
    throw SetupError(formatted(
        "the method '{}' does not support one-sided axes; use the method 'joint' or 'known'",
        name));
  }
  if (method_kind(method).by_magnitude && experiment.fit.squares && experiment.fit.robust) {
    throw SetupError(
        "the method 'magnitude' cannot fit squared terms with robust weights; leave out either "
        "'squares' or 'robust'");
  }
  if (method_kind(method).by_magnitude &&
      (experiment.fit.temperature.order > 0 || experiment.fit.temperature.automatic)) {
    throw SetupError(
        "the method 'magnitude' cannot fit temperature terms; give design points, or calibrate "
        "each temperature separately");
  }
  check_levels(used, method);
}

void check_unit(const Instrument& instrument, const FieldDescription& field) {
  const bool is_voltage = reading_factor_between("V", instrument.unit).has_value();
  if (!is_voltage && is_reading_unit(instrument.unit) && is_reading_unit(field.unit) &&
      !reading_factor_between(field.unit, instrument.unit)) {
    throw SetupError(formatted("readings in {} cannot be readings of {} in {}: is the unit, the "
                               "kind of instrument or the choice of columns wrong?",
                               instrument.unit, field.kind, field.unit),
                     {settings::instrument});
  }
}

void check_known_magnitude(const FieldDescription& field) {
  if (field.in_table && field.parts.empty() &&
      !(std::abs(field.in_table->norm() / field.magnitude - 1.0) <= 1e-6)) {
    throw SetupError(
        formatted("method 'known': the field's vector in the table's frame has the length {}, but "
                  "the field's magnitude is stated as {}; give only one of the two",
                  number_text(field.in_table->norm()), number_text(field.magnitude)));
  }
}

}  // namespace axiscal
