// SPDX-License-Identifier: Apache-2.0
#include "calibrate_command.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <utility>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/companion.hpp"
#include "axiscal/calib/history.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "experiment_options.hpp"
#include "log_input.hpp"
#include "option_names.hpp"
#include "run_input.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

void add_options(OptionSet& options, CalibrateCommand& command) {
  add_files(options, command.experiment, Need::optional);
  add_experiment_options(options, command.experiment);
  options.add("-o,--output", command.output, "FILE", "the record (JSON); - is stdout");
  options.add("--align", command.align, "RECORD",
              "record of a three-axis instrument in the same file: its frame is taken over");
  options.add("--body", command.body, "BODY",
              "method attitude: the rotation that --tare corrects, where no FILE finds one");
  options.add("--tare", command.tare, "FILE",
              "method attitude: readings in one attitude, level if none is stated, that the "
              "rotation is corrected by");
  options.add_flag("--json", command.json, "print the record instead of tables");
  options.add_flag("--all", command.all,
                   "print all that was found: sensing axes, levelness, quality of the fit");
  OptionSet log = options.group("Log");
  log.add("--imu", command.imu, "LOG",
          "a raw log of rests and turns instead of observations: accelerometer, gyroscope and "
          "magnetometer at once; -o holds {slot}, and of several sensors of a kind {instance}");
  add_rest_options(options, command.rests);
  log.add_flag("--cube", command.cube,
               "it sat in a cube: the seats are recognised; else it was turned by hand");
  log.add("--accelerometer-record", command.known_accelerometer, "RECORD",
          "of the accelerometer, where it is calibrated already");
  log.add_flag("--fit-gyroscope-bias", command.fit_gyroscope_bias,
               "by the turns, not by the rests: for a bias that wanders");
  log.add("--gyroscope-unit", command.gyroscope_unit, "UNIT",
          "of the gyroscope's readings; --unit is the accelerometer's");
  log.add("--magnetometer-unit", command.magnetometer_unit, "UNIT",
          "of the magnetometer's readings");
  log.add("--magnetic-magnitude", command.magnetic_magnitude, "F",
          "of the local magnetic field [nT]; by --latitude and --longitude, or 1");
  options.add("--limits", command.limits, "FILE",
              "accept or reject by these limits; rejected: exit 1");
  options.add("--history", command.history, "FOLDER",
              "earlier records of the unit, or of its --model: how biases change between blocks");
  options.add("--table", command.table, "FILE",
              "of many units (column 'serial'): one row each, with verdict and reason");
  options.add_flag("--accept-suggestion", command.accept_suggestion,
                   "correct, or leave out, what is most likely a mistake; the record says so");
  options.add_flag("--force", command.force, "store the record even if it is refused");
}

constexpr std::string_view slot_place = "{slot}";
constexpr std::string_view serial_place = "{serial}";
constexpr std::string_view instance_place = "{instance}";

// Puts a name in its place in a pattern, if that has one.
void put_name(std::string& path,
              const std::string& pattern,
              std::string_view place,
              const std::string& name,
              const char* how) {
  const std::size_t at = path.find(place);
  if (at == std::string::npos) {
    return;
  }
  if (name.empty()) {
    throw UsageError(formatted("-o: '{}' holds {}, but none is stated, {}", pattern, place, how));
  }
  if (name.find('/') != std::string::npos) {
    throw UsageError(formatted("-o: '{}' cannot be part of a file's name", name));
  }
  path.replace(at, place.size(), name);
}

// The record's file: `{slot}`, `{serial}` and `{instance}` in the pattern are its names.
std::string output_for(const std::string& pattern,
                       const std::string& slot,
                       const std::string& serial,
                       int instance = 0) {
  std::string path = pattern;
  put_name(path, pattern, instance_place, std::to_string(instance), "");
  put_name(path, pattern, slot_place, slot, "neither by columns SLOT.axis nor by --slot");
  put_name(path, pattern, serial_place, serial, "neither by a column 'serial' nor by --serial");
  return path;
}

// What would be refused when it is written is refused before the work.
void check_output(const std::string& output, const Experiment& experiment, const Run& run) {
  if (run.slots.size() > 1 && output != "-" && output.find(slot_place) == std::string::npos) {
    throw UsageError(
        formatted("-o: the run has {} slots, one record each; the file's name must hold {{slot}}",
                  run.slots.size()));
  }
  const std::vector<std::string> slots =
      run.slots.empty() ? std::vector<std::string>{experiment.slot} : run.slots;
  const std::string& serial =
      experiment.instrument.serial.empty() ? run.serial : experiment.instrument.serial;
  for (const std::string& slot : slots) {
    forbid_replacing_input(output_for(output, slot, serial));
  }
}

// The records as one text: an object, or a list of them for several slots.
std::string records_text(const std::vector<Calibration>& calibrations) {
  if (calibrations.size() == 1) {
    return calibration_json(calibrations.front());
  }
  std::string text = "[\n";
  for (std::size_t i = 0; i < calibrations.size(); ++i) {
    std::string record = calibration_json(calibrations[i]);
    record.pop_back();
    text += record + (i + 1 < calibrations.size() ? ",\n" : "\n");
  }
  return text + "]\n";
}

// Takes over the frame of the instrument that was recorded with it.
void align(const std::string& record,
           const Calibration& companion,
           const Observations& own,
           const Observations& companions,
           std::vector<Calibration>& calibrations) {
  if (calibrations.size() != 1) {
    throw UsageError("--align: goes with one instrument, not with several slots");
  }
  try {
    align_with_companion(calibrations.front(), own, companion, companions, record);
  } catch (const SetupError&) {
    throw;
  } catch (const DomainError& error) {
    throw DataError(record, error.what(), error.settings());
  }
}

// The verdict of a unit in a line: what a factory's log wants.
std::string verdict_line(const Calibration& calibration) {
  const Verdict& verdict = *calibration.findings.verdict;
  const std::string& serial = calibration.sensor.instrument.serial;
  return formatted("{}{} (rule {}{})", serial.empty() ? std::string("unit") : serial,
                   verdict.passed ? ": pass" : ": fail: " + reason_of(verdict), verdict.rule,
                   verdict.rule == "guarded" ? ", guard band U95" : "");
}

void apply_limits(const std::optional<Limits>& limits, std::vector<Calibration>& calibrations) {
  for (Calibration& calibration : calibrations) {
    if (limits) {
      try {
        calibration.findings.verdict = evaluate(*limits, calibration);
      } catch (const DomainError& error) {
        throw DataError(limits->path, error.what(), error.settings());
      }
    }
  }
}

// What became of the records of a run, or of one unit.
struct Outcome {
  bool refused = false;
  bool stored_refused = false;
  bool failed = false;        // some limit is not met, or some reading not confirmed
  std::string refused_slots;  // "refused", and of several slots which
  std::string text;
};

bool is_refused(const Calibration& calibration) {
  return calibration.findings.status == CalibrationStatus::refused;
}

// What is refused is stored by force alone.
bool may_be_stored(const CalibrateCommand& command, bool refused) {
  return !refused || command.force;
}

Outcome store(const CalibrateCommand& command, const std::vector<Calibration>& calibrations) {
  Outcome outcome{.refused_slots = "refused"};
  for (const Calibration& calibration : calibrations) {
    const bool refused = is_refused(calibration);
    outcome.refused = outcome.refused || refused;
    outcome.failed =
        outcome.failed || (calibration.findings.verdict && !calibration.findings.verdict->passed) ||
        (calibration.findings.confirmation && !calibration.findings.confirmation->passed);
    if (refused && !calibration.provenance.slot.empty()) {
      outcome.refused_slots +=
          (outcome.refused_slots == "refused" ? ": slot " : ", ") + calibration.provenance.slot;
    }
    outcome.text += outcome.text.empty() ? "" : "\n";
    outcome.text += summary(calibration, command.all ? SummaryDetail::full : SummaryDetail::brief);
    if (command.output && *command.output != "-" && may_be_stored(command, refused)) {
      const std::string path =
          output_for(*command.output, calibration.provenance.slot,
                     calibration.sensor.instrument.serial, calibration.provenance.instance);
      write(calibration, path);
      outcome.stored_refused = outcome.stored_refused || refused;
      outcome.text += formatted("\nrecord: {}\n", path);
    }
  }
  return outcome;
}

// What earlier records say of the run's unit; nothing without --history.
std::optional<ProcessScatter> process_of(const CalibrateCommand& command,
                                         const std::vector<Calibration>& earlier,
                                         const Experiment& experiment,
                                         const Run& run) {
  if (!command.history) {
    return std::nullopt;
  }
  Instrument unit = experiment.instrument;
  unit.serial = unit.serial.empty() ? run.serial : unit.serial;
  if (unit.serial.empty() && unit.model.empty()) {
    throw UsageError("--history: say whose with --serial or --model, or a column 'serial'");
  }
  return process_scatter(earlier, unit, run.inputs);
}

Suggestions suggestions_of(const CalibrateCommand& command) {
  return command.accept_suggestion ? Suggestions::accept : Suggestions::name;
}

// What is told of one unit of a batch.
struct Unit {
  std::string serial;
  std::string result;  // "pass", "fail", "ok", "warning", "refused", "error"
  std::string reason;
  std::vector<double> cells;  // of the table: each parameter and its uncertainty
  std::string record;         // to be stored; empty where it is not
};

// Several units, made one after another.
struct UnitsAtOnce {
  std::vector<Unit> units;
  std::vector<std::string> parameters;  // of the first that has some
};

void describe_unit(const CalibrateCommand& command,
                   const Calibration& calibration,
                   Unit& unit,
                   std::vector<std::string>& parameters) {
  const bool refused = is_refused(calibration);
  unit.result = status_name(calibration.findings.status);
  if (refused ||
      (!calibration.findings.verdict && calibration.findings.status != CalibrationStatus::ok)) {
    unit.reason = calibration.findings.warnings.front().message;
  } else if (calibration.findings.verdict) {
    unit.result = calibration.findings.verdict->passed ? "pass" : "fail";
    unit.reason = reason_of(*calibration.findings.verdict);
  }
  if (command.table) {
    for (const ParameterUncertainty& parameter : parameter_uncertainties(calibration)) {
      unit.cells.insert(unit.cells.end(), {parameter.value, parameter.uncertainty.u});
    }
    if (parameters.empty()) {
      parameters = calibration.fit.statistics->parameter_names;
    }
  }
  if (command.output && may_be_stored(command, refused)) {
    try {
      unit.record = calibration_json(calibration);
    } catch (const DomainError& error) {  // a record that nobody could read again
      unit.result = "error";
      unit.reason = error.what();
    }
  }
}

Unit calibrate_unit(const CalibrateCommand& command,
                    const Experiment& experiment,
                    const Run& run,
                    const std::optional<Limits>& limits,
                    const std::vector<Calibration>& earlier,
                    std::vector<std::string>& parameters) {
  Unit unit{.serial = run.serial};
  try {
    Experiment own = experiment;
    own.instrument.serial = run.serial;
    own.process = process_of(command, earlier, own, run);
    std::vector<Calibration> calibrations = calibrate_run(own, run, suggestions_of(command));
    apply_limits(limits, calibrations);
    describe_unit(command, calibrations.front(), unit, parameters);
  } catch (const RefusedError& error) {
    unit.result = "error";
    unit.reason = with_options(error);
  }
  return unit;
}

// The batch as a table: a row for each unit.
std::string table_of(const std::vector<Unit>& units, const std::vector<std::string>& parameters) {
  std::string text = "serial,result,reason";
  for (const std::string& parameter : parameters) {
    text += formatted(",{},{}", csv_cell(parameter), csv_cell("u_" + parameter));
  }
  text += "\n";
  for (const Unit& unit : units) {
    text += formatted("{},{},{}", csv_cell(unit.serial), unit.result, csv_cell(unit.reason));
    for (std::size_t cell = 0; cell < 2 * parameters.size(); ++cell) {
      text += "," + (cell < unit.cells.size() ? number_text(unit.cells[cell]) : "");
    }
    text += "\n";
  }
  return text;
}

// Each unit's record and the table need files of their own, none of them an input: seen before the
// work.
void check_outputs(const CalibrateCommand& command, const UnitsOfRun& units) {
  if (command.output && units.size() > 1 &&
      command.output->find(serial_place) == std::string::npos) {
    throw UsageError(formatted(
        "-o: the readings are of {} units, one record each; the file's name must hold {{serial}}",
        units.size()));
  }
  std::set<std::filesystem::path> files;
  const auto add = [&](const std::string& path) {
    forbid_replacing_input(path);
    if (path != "-" && !files.insert(std::filesystem::weakly_canonical(path)).second) {
      throw UsageError(
          formatted("'{}' would be written twice: by -o and --table, or by two units", path));
    }
  };
  if (command.table) {
    add(*command.table);
  }
  for (std::size_t i = 0; i < units.size() && command.output; ++i) {
    add(output_for(*command.output, "", units.serial(i)));
  }
}

// Many units in one run: a line each, the yield, and why the others failed.
int run_batch(const CalibrateCommand& command,
              const Experiment& experiment,
              Run run,
              const std::optional<Limits>& limits,
              const std::vector<Calibration>& earlier) {
  if (!command.table &&
      (!command.output || command.output->find(serial_place) == std::string::npos)) {
    throw UsageError(
        "the readings are of several units (column 'serial'): one record each needs -o with "
        "{serial}, or one row each --table FILE");
  }
  if (command.output == "-" || command.align || command.json) {
    throw UsageError(
        "several units go to files with {serial} or to --table, not with -o -, --json or --align");
  }
  std::vector<Unit> units;
  std::vector<std::string> parameters;
  std::string text;
  std::size_t good = 0;
  std::optional<UnitsOfRun> all(std::in_place, std::move(run), experiment.instrument.serial);
  check_outputs(command, *all);
  // Records are stored as they come, in their order: all of thousands would fill the memory.
  constexpr std::size_t at_once = 16;
  std::size_t begin = 0;
  const auto next = [&]() -> std::optional<std::function<UnitsAtOnce()>> {
    if (begin == all->size()) {
      return std::nullopt;
    }
    const std::size_t first = begin;
    begin = std::min(first + at_once, all->size());
    return [&, first, last = begin] {
      UnitsAtOnce piece;
      for (std::size_t i = first; i < last; ++i) {
        piece.units.push_back(
            calibrate_unit(command, experiment, (*all)[i], limits, earlier, piece.parameters));
      }
      return piece;
    };
  };
  for_each_in_order<UnitsAtOnce>(next, [&](UnitsAtOnce piece) {
    if (parameters.empty()) {
      parameters = std::move(piece.parameters);
    }
    for (Unit& unit : piece.units) {
      const std::string record = std::move(unit.record);  // whose memory is free at once
      if (!record.empty()) {
        write_whole_file(output_for(*command.output, "", unit.serial), record);
      }
      good += unit.result == "pass" || unit.result == "ok" || unit.result == "warning" ? 1U : 0U;
      text +=
          formatted("{}: {}{}\n", unit.serial.empty() ? std::string("(no serial)") : unit.serial,
                    unit.result, unit.reason.empty() ? "" : ": " + unit.reason);
      units.push_back(std::move(unit));
    }
  });
  all.reset();  // makes room for the table
  text += formatted("yield: {} of {} units ({:.1f} %)\n", good, units.size(),
                    100.0 * static_cast<double>(good) / static_cast<double>(units.size()));
  if (command.table && *command.table != "-") {
    write_whole_file(*command.table, table_of(units, parameters));
  }
  print_result_text(command.table == "-" ? table_of(units, parameters) : text);
  return good == units.size() ? 0 : 1;
}

}  // namespace

int deliver_records(const CalibrateCommand& command,
                    const std::vector<Calibration>& calibrations,
                    const std::string& heading) {
  Outcome outcome = store(command, calibrations);
  outcome.text.insert(0, heading);
  if (command.output == "-" && may_be_stored(command, outcome.refused)) {
    write_whole_file("-", records_text(calibrations));
    outcome.stored_refused = true;
  } else if (command.output != "-") {
    print_result_text(command.json ? records_text(calibrations) : outcome.text);
  }
  print_remarks(calibrations);
  for (const Calibration& calibration : calibrations) {
    if (calibration.findings.verdict) {
      std::fprintf(stderr, "%s\n", verdict_line(calibration).c_str());
    }
  }
  if (command.output != "-" && !command.json) {
    std::for_each(calibrations.begin(), calibrations.end(), print_verdict);
  }
  if (outcome.refused) {
    std::fprintf(stderr, "axiscal: %s%s\n", outcome.refused_slots.c_str(),
                 outcome.stored_refused ? "; the record is stored as such, as --force asks"
                                        : "; its record is not stored (--force would)");
    return 1;
  }
  return outcome.failed ? 1 : 0;
}

namespace {

// What the options leave open, and the first table's columns say: the axes where they are not x, y,
// z, by that the kind of instrument, and the unit.
ExperimentOptions with_what_the_table_says(ExperimentOptions options, const TableOptions& table) {
  const std::string path = options.files.front();
  if (is_experiment_file(path) || !can_be_read_again(path) || states_slots(options) ||
      (options.axes && options.instrument && options.unit)) {
    return options;
  }
  const TableText text(path, format_of(table));
  const auto has = [&](const std::string& name) {
    return std::any_of(text.columns().begin(), text.columns().end(), [&](const NamedColumn& one) {
      return one.name == name || one.name.ends_with("." + name);
    });
  };
  const std::optional<LogSensor> sensor =
      options.axes ? std::nullopt : sensor_of_kind(text, options.instrument.value_or(""));
  const bool has_usual = has("x") && has("y") && has("z");
  if (sensor) {
    if (!has_usual) {
      options.axes = joined({sensor->columns.begin(), sensor->columns.end()}, ",");
    }
    if (!has_usual || !options.instrument) {
      print_remark("note", path + ": " + sensor->words);
    }
    if (!options.instrument) {
      options.instrument = name_of(sensor->kind);
    }
  }
  if (!options.unit) {
    const std::vector<std::string> axes =
        options.axes ? names_of(*options.axes) : std::vector<std::string>{"x", "y", "z"};
    std::set<std::string> units;
    std::string note;
    for (const std::string& axis : axes) {
      for (const NamedColumn& one : text.columns()) {
        if (in_small_letters(one.name) == in_small_letters(axis)) {
          units.insert(one.unit);
        }
      }
    }
    if (units.size() == 1 && !units.begin()->empty()) {
      const SeriesKind kind = sensor ? sensor->kind : SeriesKind::other;
      const std::optional<KnownUnit> known = known_unit(*units.begin(), kind);
      note = take_unit_of_file(known ? std::string(known->name) : *units.begin(), options);
    } else if (sensor && !sensor->unit.empty()) {
      note = take_unit_of_file(sensor->unit, options);
    }
    if (!note.empty()) {
      print_remark("note", note);
    }
  }
  return options;
}

int run(const CalibrateCommand& command) {
  if (command.experiment.method == "attitude") {
    return run_attitude(command);
  }
  if (command.body || command.tare) {
    throw UsageError("--body, --tare: go with --method attitude");
  }
  if (command.experiment.files.empty() == !command.imu.has_value()) {
    throw UsageError("calibrate: needs FILEs of observations, or --imu LOG, one of them");
  }
  if (command.imu) {
    return run_imu(command);
  }
  const std::vector<std::string> of_logs = stated_options_of(command.rests);
  if (!of_logs.empty()) {
    throw UsageError(formatted(
        "calibrate: {} {} for a log (--imu), and tables of readings are read without; name their "
        "axes by --axes, and columns without a header by --names",
        joined(of_logs), of_logs.size() == 1 ? "is" : "are"));
  }
  const TableOptions& table = command.rests.log.table;
  ExperimentFile file = make_experiment_file(with_what_the_table_says(command.experiment, table));
  Experiment& experiment = file.experiment;
  const std::string limits_path = command.limits.value_or(file.paths.limits);
  const std::optional<Limits> limits =
      limits_path.empty() ? std::nullopt : std::optional(read_limits(limits_path));
  const std::vector<Calibration> earlier =
      command.history ? read_records(*command.history) : std::vector<Calibration>{};
  std::optional<Calibration> companion;
  std::optional<ObservationColumns> beside;
  if (command.align) {
    companion = read_calibration(*command.align);
    if (is_refused(*companion)) {
      throw RefusedError(*command.align + ": this calibration was refused");
    }
    beside = {.axes = companion->sensor.instrument.axes,
              .differences = companion->sensor.instrument.differences,
              .range = companion->sensor.instrument.range};
  }
  Observations companions;
  Run run = read_run(file, Units::several, {.options = table}, beside, &companions);
  experiment.positioner =
      with_assembly(experiment.positioner, command.experiment.assembly, run.slots);
  experiment.slot = slot_of(experiment, run);
  if (has_several_units(run) || command.table) {
    return run_batch(command, experiment, std::move(run), limits, earlier);
  }
  experiment.process = process_of(command, earlier, experiment, run);
  if (command.history && !experiment.process) {
    print_remark("note", *command.history +
                             ": no earlier records of the unit, so nothing is known of how biases "
                             "change between blocks");
  }
  if (command.output) {
    check_output(*command.output, experiment, run);
  }
  std::vector<Calibration> calibrations = calibrate_run(experiment, run, suggestions_of(command));
  if (companion) {
    align(*command.align, *companion, run.observations, companions, calibrations);
  }
  apply_limits(limits, calibrations);
  return deliver_records(command, calibrations);
}

}  // namespace

Subcommand calibrate_subcommand() {
  return make_subcommand<CalibrateCommand>("calibrate", "observations -> calibration record", "",
                                           &add_options, &run);
}

}  // namespace axiscal::cli
