// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <memory>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/body.hpp"
#include "axiscal/calib/calibrate_run.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/history.hpp"
#include "axiscal/calib/labelled_check.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "experiment_options.hpp"
#include "run_input.hpp"
#include "sample_rests.hpp"
#include "store_client.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct CheckCommand {
  std::string record;
  std::optional<std::string> other;  ///< observations or another record
  ExperimentOptions experiment;      ///< settings that differ from those of the record
  TableOptions table;
  std::optional<std::string> history, limits, alpha;
  std::string output = "-";
  bool json = false;
};

void add_options(OptionSet& options, CheckCommand& command) {
  options.add("record", command.record, "RECORD", "calibration record (JSON)");
  options.add("other", command.other, "FILE", "readings (CSV) or another record (JSON)");
  add_experiment_options(options, command.experiment);
  add_table_options(options, command.table);
  options.add("--alpha", command.alpha, "P", "probability of a false alarm [default: 0.01]");
  options.add("--limits", command.limits, "FILE",
              "file of limits by which the instrument is accepted or rejected");
  options.add(
      "--history", command.history, "FOLDER",
      "records of one or many units (a folder, a .jsonl file or a store): show the trend, and when "
      "a limit will be reached");
  options.add_output(command.output);
  options.add_flag("--json", command.json, "print JSON instead of a table");
}

Json json_of(const std::vector<ParameterChange>& changes, bool with_e_n) {
  Json list = Json::array();
  for (const ParameterChange& change : changes) {
    Json one = {{"parameter", change.parameter},
                {"old", change.old_value},
                {"new", change.new_value},
                {"u", change.u},
                {"z", change.z}};
    if (with_e_n) {
      one["e_n"] = change.e_n;
    }
    list.push_back(std::move(one));
  }
  return list;
}

// Returns a remark if the record was made from the readings to be checked (`own` is true). Such
// readings always agree with the record, so they cannot show a change.
std::string own_text(bool own) {
  return own ? "The record was made from these readings, so they always agree. Take new readings "
               "to test for drift.\n"
             : "";
}

std::string check_json(const DriftCheck& check, const std::optional<Verdict>& verdict, bool own) {
  Json json = {{"own_readings", own},
               {"drifted", check.drifted},
               {"p_value", check.p_value},
               {"alpha", check.alpha},
               {"changes", json_of(check.changes, false)},
               {"intrinsic", json_of(check.intrinsic, true)},
               {"pitch_error_deg", check.pitch_error_deg},
               {"pitch_error_u_deg", check.pitch_error_u_deg},
               {"pitch_error_U_deg", check.pitch_error_expanded_deg},
               {"notes", check.notes}};
  if (verdict) {
    json["verdict"] = Json::parse(verdict_json(*verdict));
  }
  return json_text(json);
}

std::string changes_text(const std::vector<ParameterChange>& changes, bool with_e_n) {
  std::string text = formatted("  {:<20}{:>15}{:>15}{:>12}{:>8}{}\n", "", "old", "new", "u", "z",
                               with_e_n ? "     E_n" : "");
  for (const ParameterChange& change : changes) {
    text += formatted("  {:<20}{:>15.7g}{:>15.7g}{:>12.2g}{:>8.1f}", change.parameter,
                      change.old_value, change.new_value, change.u, change.z);
    text += with_e_n ? formatted("{:>8.2f}\n", change.e_n) : "\n";
  }
  return text;
}

// Converts the angles in `changes` from radians to degrees.
std::vector<ParameterChange> in_degrees(std::vector<ParameterChange> changes) {
  for (ParameterChange& change : changes) {
    if (change.parameter.starts_with("angle.")) {
      for (double* const value : {&change.old_value, &change.new_value, &change.u}) {
        *value *= deg_per_rad;
      }
    }
  }
  return changes;
}

std::string check_text(const DriftCheck& check, const Calibration& record) {
  std::string text = check.drifted
                         ? "drifted: the coefficients differ by more than chance (p = "
                         : "no drift: the coefficients differ by no more than chance (p = ";
  text += number_text(check.p_value, 2) + ")\n";
  const bool has_pitch = find_instrument_kind(record.sensor.instrument.kind).has_axis_elevation;
  if (std::isfinite(check.pitch_error_deg)) {
    text += formatted(
        "with the old record, {} now has an error of up to {:.3g} degrees (u {:.2g}; U {:.2g} for "
        "the largest error over all directions)\n",
        has_pitch ? "pitch (up to 80 degrees)" : "the field's direction", check.pitch_error_deg,
        check.pitch_error_u_deg, check.pitch_error_expanded_deg);
  }
  text += "\nCoefficients\n" + changes_text(check.changes, false);
  if (check.intrinsic.empty()) {
    return text;
  }
  text +=
      "\nQuantities independent of the mounting: biases, sensitivities, angles between axes "
      "[degrees]\n" +
      changes_text(in_degrees(check.intrinsic), true);
  return text;
}

std::string in_situ_json(const InSituCheck& check, bool own) {
  Json json = {{"own_readings", own},       {"drifted", check.drifted},
               {"p_value", check.p_value},  {"changes", Json::array()},
               {"residual_rss", check.rss}, {"expected_rss", check.expected_rss},
               {"readings", Json::array()}};
  for (const InSituReading& reading : check.readings) {
    json["readings"].push_back({{"run", reading.run},
                                {"residual", reading.residual},
                                {"limit", reading.limit},
                                {"within", reading.within}});
  }
  return json_text(json);
}

std::string in_situ_text(const InSituCheck& check, const std::string& unit) {
  std::string text = check.drifted ? "drifted: " : "no drift: ";
  std::size_t outside = 0;
  for (const InSituReading& reading : check.readings) {
    outside += reading.within ? 0U : 1U;
  }
  text += formatted("{} of {} readings at rest are outside their control limits (p = {})\n",
                    outside, check.readings.size(), number_text(check.p_value, 2));
  text += formatted(
      "root sum of squares of the residuals {:.3g} {}, expected {:.3g}\n\n  "
      "{:>6}{:>14}{:>14}\n",
      check.rss, unit, check.expected_rss, "run", "residual", "limit");
  for (const InSituReading& reading : check.readings) {
    text += formatted("  {:>6}{:>14.3g}{:>14.3g}{}\n", reading.run, reading.residual, reading.limit,
                      reading.within ? "" : "  outside");
  }
  return text;
}

bool is_record(const std::string& path) {
  return path.ends_with(".json");
}

bool has_pose(const Observations& observations) {
  const Reading& first = observations.readings.front();
  return first.point || first.field_in_sensor || first.attitude;
}

int report(const CheckCommand& command,
           const std::string& json,
           const std::string& text,
           bool failed) {
  write_text(command.output, command.json ? json : text);
  return failed ? 1 : 0;
}

int run_history(const CheckCommand& command) {
  if (!command.record.empty() || command.other) {
    throw UsageError("check --history: cannot be combined with RECORD and FILE");
  }
  const std::optional<Limits> limits =
      command.limits ? std::optional(read_limits(*command.limits)) : std::nullopt;
  std::vector<std::string> passed_over;
  std::vector<std::string> not_held;
  std::vector<UnitHistory> units;
  try {
    units = read_history(named_records(*command.history), limits, &passed_over, &not_held);
  } catch (const DomainError& error) {
    throw DataError(command.limits.value_or(""), error.what(), error.settings());
  }
  for (const std::string& reason : passed_over) {
    print_line(formatted("note: skipped: {}", reason));
  }
  if (!not_held.empty()) {
    print_remark("note",
                 formatted("a history contains only biases and sensitivities; other limits are not "
                           "checked: {}",
                           joined(not_held)));
  }
  bool outside = false;
  for (const UnitHistory& unit : units) {
    for (const ParameterTrend& trend : unit.trends) {
      outside = outside || trend.outside;
    }
  }
  if (units.empty()) {
    throw DataError(*command.history, "there are no calibration records (*.json) here");
  }
  std::string text;
  for (const UnitHistory& unit : units) {
    text += history_text(unit) + "\n";
  }
  return report(command, command.json ? history_json(units) : "", text, outside);
}

double alpha_of(const CheckCommand& command) {
  double alpha = 0.01;
  if (command.alpha) {
    alpha = number_of("--alpha", *command.alpha);
    if (!(alpha > 0.0 && alpha < 1.0)) {
      throw UsageError("--alpha: must be between 0 and 1");
    }
  }
  return alpha;
}

struct FreshReadings {
  Experiment experiment;
  Run run;
  std::optional<double> temperature;  // mean temperature of the readings; nullopt if unknown
};

std::optional<double> mean_temperature(const Observations& observations) {
  double sum = 0.0;
  for (const Reading& reading : observations.readings) {
    if (!reading.temperature) {
      return std::nullopt;
    }
    sum += reading.temperature->mean();
  }
  return sum / static_cast<double>(observations.readings.size());
}

// Returns the positioner. If it has no mounts, adds the mount of the record's instrument.
Positioner positioner_of(const Positioner& positioner, const Calibration& old) {
  if (!old.sensor.rotation_sensor_from_assembly || !positioner.mounts().empty()) {
    return positioner;
  }
  return positioner.with_mounts(
      {{.slot = old.provenance.slot,
        .rotation_sensor_from_positioner = *old.sensor.rotation_sensor_from_assembly}});
}

// Reads new readings of the record's instrument. Converts them to the record's reference
// temperature.
FreshReadings read_fresh(const CheckCommand& command, const Calibration& old) {
  ExperimentOptions options = command.experiment;
  options.files = {*command.other};
  ExperimentFile without_method = make_experiment_file(options, experiment_of(old));
  FreshReadings fresh{.experiment = without_method.experiment};
  // Without a method, read_run() does not require pose labels in the new readings.
  without_method.experiment.fit.method.reset();
  fresh.run =
      read_run(without_method, Units::one,
               {.options = command.table,
                .kind = old.sensor.instrument.differences.empty() ? old.sensor.instrument.kind : "",
                .unit = old.sensor.instrument.unit,
                .faces_of = old.sensor.instrument.kind,
                .of_recording = old.sensor.instrument.kind});
  restore_count_signs(fresh.run);
  if (!gather_rests(old.sensor.instrument.kind, fresh.run) &&
      old.sensor.instrument.kind == "accelerometer") {
    require_readings(fresh.run);
  }
  if (old.sensor.temperature && !fresh.run.observations.readings.front().temperature) {
    print_remark("note",
                 "the readings lack the column 'temperature'; the reference temperature of the "
                 "record is assumed");
  }
  fresh.temperature = mean_temperature(fresh.run.observations);
  fresh.run.observations = at_reference_temperature(std::move(fresh.run.observations), old);
  if (!method_kind(old.fit.method).fits_sensitivity) {
    // The readings are converted to the reference temperature, so temperature terms are not needed.
    // Each reading still needs a temperature, because the method `bias` requires one.
    for (Reading& reading : fresh.run.observations.readings) {
      reading.temperature = old.sensor.temperature ? old.sensor.temperature->reference() : 0.0;
    }
    fresh.experiment.fit.temperature.order = 0;
    if (gives_field(old)) {
      fresh.experiment.from = std::make_shared<const Calibration>(old);
    }
  }
  return fresh;
}

Calibration calibration_of(const CheckCommand& command,
                           FreshReadings readings,
                           const Calibration& old) {
  readings.experiment.positioner =
      positioner_of(with_assembly(readings.experiment.positioner, command.experiment.assembly,
                                  readings.run.slots),
                    old);
  std::vector<Calibration> calibrations = calibrate_run(readings.experiment, readings.run);
  // Removes the warning field_in_bias, because `check` prints its own note instead.
  for (Calibration& calibration : calibrations) {
    std::erase_if(calibration.findings.warnings, [](const CalibrationWarning& warning) {
      return warning.code == WarningCode::field_in_bias;
    });
  }
  if (calibrations.size() != 1) {
    throw UsageError("check: requires readings of one instrument, not of several slots");
  }
  Calibration fresh = std::move(calibrations.front());
  if (fresh.findings.status == CalibrationStatus::refused) {
    throw RefusedError("no calibration could be computed from the new readings: " +
                       fresh.findings.warnings.front().message);
  }
  print_remarks({fresh});
  if (old.sensor.temperature && method_kind(old.fit.method).fits_sensitivity) {
    // The new readings were converted to this reference temperature.
    fresh.sensor.temperature = old.sensor.temperature;
  }
  return fresh;
}

bool is_body_rotation(const std::string& path) {
  return is_record(path) && can_be_read_again(path) &&
         read_whole_file(path).find("\"axiscal-rotation\"") != std::string::npos;
}

// Compares two calibrations of a sensor's rotation in the body that carries it, and reports whether
// the sensor has moved.
int compare_bodies(const CheckCommand& command, double alpha) {
  const BodyChange change =
      compare_rotations(read_body_rotation(command.record), read_body_rotation(*command.other));
  const bool moved = change.p_value < alpha;
  Json json = {{"drifted", moved}, {"p_value", change.p_value}, {"alpha", alpha}};
  std::string text = "rotation of the sensor in the model between the two records [degrees]\n";
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double turn_deg = change.turn_rad(i) * deg_per_rad;
    const double u_deg = change.u_rad(i) * deg_per_rad;
    json["changes"].push_back({{"parameter", std::string("turn_") + "xyz"[i] + "_deg"},
                               {"old", 0.0},
                               {"new", turn_deg},
                               {"u", u_deg},
                               {"z", u_deg > 0.0 ? turn_deg / u_deg : 0.0}});
    text += formatted("  {}  {:>12.6f}  u {:.6f}\n", "xyz"[i], turn_deg, u_deg);
  }
  text += formatted("{} (p = {:.2g})\n", moved ? "the sensor has moved" : "no significant movement",
                    change.p_value);
  return report(command, json_text(json), text, moved);
}

void print_notes(const DriftCheck& check) {
  for (const std::string& note : check.notes) {
    print_remark("note", note);
  }
}

// Returns true if each reading has a label and can be compared with the record's prediction.
bool can_be_predicted(const Run& run, const Calibration& old) {
  return run.slots.empty() && run.observations.readings.front().point &&
         run.observations.has_fence && old.sensor.field.parts.empty() &&
         method_kind(old.fit.method).fits_sensitivity && gives_field(old);
}

// Returns true if the readings have labels, but there are fewer than 12 of them. A complete design
// has 12 readings.
bool is_few(const Run& run, const Calibration& old) {
  constexpr Eigen::Index whole_design = 12;
  return can_be_predicted(run, old) && run.observations.size() < whole_design;
}

DriftCheck check_few(const CheckCommand& command,
                     FreshReadings readings,
                     const Calibration& old,
                     double alpha) {
  Experiment& experiment = readings.experiment;
  experiment.positioner = positioner_of(
      with_assembly(experiment.positioner, command.experiment.assembly, readings.run.slots), old);
  experiment.slot = slot_of(experiment, readings.run);
  experiment.rotation_sensor_from_positioner =
      mount_rotation(experiment.positioner, experiment.slot);
  return check_labelled(old, experiment, readings.run.observations, alpha);
}

std::optional<Verdict> verdict_of(const CheckCommand& command,
                                  const std::optional<Limits>& limits,
                                  const Calibration& fresh,
                                  const DriftCheck& check) {
  if (!limits) {
    return std::nullopt;
  }
  try {
    return evaluate(*limits, fresh, &check);
  } catch (const DomainError& error) {
    throw DataError(*command.limits, error.what(), error.settings());
  }
}

int run(const CheckCommand& command) {
  if (command.history) {
    return run_history(command);
  }
  if (command.record.empty() || !command.other) {
    throw UsageError(
        "check: requires a RECORD, and a FILE (readings or another record) to compare with the "
        "RECORD");
  }
  const double alpha = alpha_of(command);
  if (is_body_rotation(command.record)) {
    return compare_bodies(command, alpha);
  }
  const std::optional<Limits> limits =
      command.limits ? std::optional(read_limits(*command.limits)) : std::nullopt;
  const Calibration old = read_calibration(command.record);
  if (old.findings.status == CalibrationStatus::refused) {
    throw RefusedError(command.record +
                       ": this calibration was refused, so it cannot be a reference for others");
  }
  if (command.experiment.instrument &&
      *command.experiment.instrument != old.sensor.instrument.kind) {
    throw UsageError(
        "--instrument: leave the option out, or give the kind that is in the "
        "record: " +
        old.sensor.instrument.kind);
  }
  Calibration fresh;
  std::optional<double> temperature;
  bool own = false;
  try {
    if (is_record(*command.other)) {
      fresh = read_calibration(*command.other);
      if (fresh.findings.status == CalibrationStatus::refused) {
        throw RefusedError(*command.other + ": this calibration was refused");
      }
      own = is_made_from(old, fresh.provenance.inputs);
    } else {
      FreshReadings readings = read_fresh(command, old);
      own = is_made_from(old, readings.run.inputs);
      temperature = readings.temperature;
      if (gives_field(old) && !has_pose(readings.run.observations) &&
          !method_kind(old.fit.method).by_magnitude) {
        if (limits) {
          throw UsageError(
              "--limits: coefficients cannot be computed from readings without labels, so they "
              "cannot be compared with limits");
        }
        const InSituCheck check = check_in_situ(old, readings.run.observations, alpha);
        return report(command, in_situ_json(check, own),
                      own_text(own) + in_situ_text(check, old.sensor.field.unit), check.drifted);
      }
      std::string why_predicted = "there are fewer than 12 readings";
      bool predicted = is_few(readings.run, old);
      if (predicted && limits) {
        throw UsageError(
            "--limits: coefficients cannot be computed from fewer than 12 readings, so they cannot "
            "be compared with limits");
      }
      if (!predicted) {
        try {
          fresh = calibration_of(command, readings, old);
        } catch (const RefusedError& error) {
          if (limits || !can_be_predicted(readings.run, old)) {
            throw;
          }
          predicted = true;
          why_predicted = error.what();
        }
      }
      if (predicted) {
        const DriftCheck check = check_few(command, readings, old, alpha);
        print_remark("note", why_predicted);
        print_notes(check);
        return report(command, check_json(check, std::nullopt, own),
                      own_text(own) + check_text(check, old), check.drifted);
      }
    }
    const DriftCheck check = gives_field(old) && gives_field(fresh)
                                 ? check_drift(old, fresh, alpha)
                                 : check_biases(old, fresh, temperature, alpha);
    const std::optional<Verdict> verdict = verdict_of(command, limits, fresh, check);
    print_notes(check);
    const bool failed = check.drifted || (verdict && !verdict->passed);
    const int status = report(command, check_json(check, verdict, own),
                              own_text(own) + check_text(check, old), failed);
    if (verdict) {
      const std::string& serial = fresh.sensor.instrument.serial;
      print_line(formatted("{}: {}", serial.empty() ? "unit" : serial,
                           verdict->passed ? "pass" : "fail: " + reason_of(*verdict)));
    }
    return status;
  } catch (const SetupError&) {
    throw;
  } catch (const DomainError& error) {
    throw DataError(command.record, error.what(), error.settings());
  }
}

}  // namespace

Subcommand check_subcommand() {
  return make_subcommand<CheckCommand>(
      "check", "test whether an instrument has drifted since its calibration",
      "Readings without labels must be taken at rest; only the magnitude of the field\n"
      "is checked. Options are needed only if they differ from the record's. The exit\n"
      "status is 1 if the instrument has drifted or a limit is not met.",
      &add_options, &run);
}

}  // namespace axiscal::cli
