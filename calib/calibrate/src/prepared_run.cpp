// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/prepared_run.hpp"

#include <algorithm>
#include <iterator>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/field/settings.hpp"
#include "calib/calibrate/src/method_choice.hpp"
#include "calib/calibrate/src/remarks.hpp"
#include "calib/calibrate/src/run_checks.hpp"
#include "calib/calibrate/src/stated_attitudes.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

std::optional<Observations> with_fields(const Experiment& experiment,
                                        const Observations& observations) {
  return takes_attitudes(experiment, observations)
             ? std::optional(with_fields_of_attitudes(experiment, observations))
             : std::nullopt;
}

// Runs the checks that do not depend on the method.
const Observations& checked(const Experiment& experiment, const Observations& observations) {
  check_run(experiment, observations);
  return observations;
}

const Experiment& checked_temperature(const Experiment& experiment,
                                      const Observations& used,
                                      Method method) {
  check_temperature(experiment, used.readings, method);
  return experiment;
}

// Returns the readings that are fitted, without their responses; nullopt if all are fitted.
std::optional<Observations> without_left_out(const Experiment& experiment,
                                             const Observations& observations) {
  const auto is_out = [&](const Reading& reading) {
    const std::vector<int>& out = experiment.leave_out;
    return reading.confirm || std::find(out.begin(), out.end(), reading.run) != out.end();
  };
  const std::vector<Reading>& all = observations.readings;
  if (std::none_of(all.begin(), all.end(), is_out)) {
    return std::nullopt;
  }
  Observations used;
  std::remove_copy_if(all.begin(), all.end(), std::back_inserter(used.readings), is_out);
  used.has_fence = observations.has_fence;
  return used;
}

// The smallest and the largest magnitude of the fields stated with the readings. Fields of
// magnitude 0 are not counted.
struct MetFields {
  double least = 0.0;
  double largest = 0.0;

  // Returns true if the magnitudes differ by more than 5 %. Rounding and small errors of the angles
  // cause smaller differences.
  [[nodiscard]] bool vary() const {
    constexpr double alike = 1.05;
    return largest > alike * least;
  }
};

MetFields fields_met_by(const Observations& observations) {
  MetFields met;
  for (const Reading& reading : observations.readings) {
    const double length = reading.field_in_sensor ? reading.field_in_sensor->norm() : 0.0;
    if (length > 0.0) {
      met.least = met.least == 0.0 ? length : std::min(met.least, length);
      met.largest = std::max(met.largest, length);
    }
  }
  met.largest = met.largest == 0.0 ? 1.0 : met.largest;  // all fields are 0; refused later
  met.least = met.least == 0.0 ? met.largest : met.least;
  return met;
}

bool uses_fields_of_readings(Method method, const Observations& observations) {
  return method_kind(method).directions_known && has_stated_fields(observations);
}

}  // namespace

bool in_one_pose(const Reading& a, const Reading& b) {
  return a.point == b.point && a.level == b.level &&
         a.field_in_sensor.has_value() == b.field_in_sensor.has_value() &&
         (!a.field_in_sensor || *a.field_in_sensor == *b.field_in_sensor);
}

std::vector<std::size_t> PreparedRun::rows_not_left_out() const {
  const std::vector<int>& out = experiment_.leave_out;
  const std::vector<Reading>& readings = observations().readings;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (std::find(out.begin(), out.end(), readings[i].run) == out.end()) {
      rows.push_back(i);
    }
  }
  return rows;
}

PreparedRun::PreparedRun(const Experiment& experiment, const Observations& observations)
    : experiment_(experiment),
      given_(observations),
      with_fields_(with_fields(experiment, observations)),
      used_(without_left_out(experiment, checked(experiment, this->observations()))),
      method_(choose_method(experiment, used())),
      weighting_(
          experiment.fit.weighting.value_or(given_.samples ? Weighting::samples : Weighting::none)),
      source_(checked_temperature(experiment, used(), method_),
              this->observations(),
              weighting_,
              uses_fields_of_readings(method_, this->observations())) {
  check_method(experiment, this->observations(), used(), method_, by_field());
  std::optional<MetFields> met;
  if (by_field()) {
    met = fields_met_by(used());
  }
  parts_ = resolve_field(experiment, source_.mean_time_s(),
                         met ? std::optional(met->largest) : std::nullopt);
  if (met && met->vary() && parts_.size() == 1) {
    field_varies_ = true;
    parts_.front().magnitude_u *= met->largest / parts_.front().magnitude;
    parts_.front().magnitude = met->largest;
    notes_.push_back(
        {NoteCode::field, formatted("the magnitude of the field at the readings ranges from {} to "
                                    "{}{}; the full response is the response to the largest field",
                                    number_text(met->least, 4), number_text(met->largest, 4),
                                    parts_.front().unit == "1" ? "" : " " + parts_.front().unit)});
  }
  check_unit(experiment.instrument, parts_.front());
  if (field_moves(experiment) && !by_field() && !parts_.front().in_table) {
    throw RefusedError(experiment.field.moving_part()->of->moving_name() +
                           " requires the time of the readings: a column 'time' (ISO 8601, UTC), "
                           "or a date with a time of day",
                       {settings::date});
  }
}

Calibration PreparedRun::described() const {
  Calibration calibration;
  calibration.findings.notes = notes_;
  calibration.provenance.created = output_timestamp();
  calibration.provenance.software = software_name();
  calibration.provenance.positioner = experiment_.positioner.id();
  calibration.provenance.slot = experiment_.slot;
  calibration.sensor.instrument = experiment_.instrument;
  calibration.sensor.field = describe_field(experiment_.table, parts_);
  calibration.fit.method = method_;
  calibration.fit.weights = weighting_;
  calibration.fit.robust = experiment_.fit.robust;
  calibration.fit.level_by_block = experiment_.fit.level_by == LevelBy::block;
  calibration.fit.left_out = experiment_.leave_out;
  note_choice_of_method(used(), method_, calibration);
  note_weights(experiment_, used(), calibration);
  if (method().directions_known && !by_field()) {
    check_known_magnitude(calibration.sensor.field);
  }
  return calibration;
}

}  // namespace axiscal
