// SPDX-License-Identifier: Apache-2.0
#include "calibrate_command.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/companion.hpp"
#include "axiscal/calib/history.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "core/formatted.hpp"
#include "core/redirected_streams.hpp"
#include "experiment_options.hpp"
#include "log_input.hpp"
#include "option_names.hpp"
#include "run_input.hpp"
#include "sample_rests.hpp"
#include "store_client.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

void add_options(OptionSet& options, CalibrateCommand& command) {
  add_files(options, command.experiment, Need::optional);
  add_experiment_options(options, command.experiment);
  options.add("-o,--output", command.output, "FILE", "file of the record (JSON); - is stdout");
  options.add("--align", command.align, "RECORD",
              "record of a three-axis instrument whose readings are in the same FILE; the "
              "calibration is rotated to that instrument's frame");
  options.add("--body", command.body, "BODY",
              "file of the rotation that --tare corrects (method 'attitude'), if no FILE of "
              "readings in known attitudes is given");
  options.add("--tare", command.tare, "FILE",
              "readings in one known attitude; they correct the rotation from the readings or from "
              "--body (method 'attitude'). An attitude that is not given is taken as level");
  options.add_flag("--json", command.json, "print the record instead of tables");
  options.add_flag("--all", command.all,
                   "print all results: sensing axes, levelness, quality of the fit");
  OptionSet log = options.group("Log");
  log.add("--imu", command.imu, "LOG",
          "a raw log of rests and turns, or several logs of one recording; accelerometer, "
          "gyroscope and magnetometer are calibrated at once. -o must contain {slot}, and "
          "{instance} if several sensors of a kind are calibrated");
  log.add("--only", command.only, "SLOT,..",
          "calibrate only some sensors of the log: accelerometer, gyroscope, magnetometer");
  add_rest_options(options, command.rests);
  log.add_flag(
      "--cube", command.cube,
      "recognise the seats of a cube that contains the instrument; without this option the "
      "instrument is assumed to be turned by hand");
  log.add("--accelerometer-record", command.known_accelerometer, "RECORD",
          "existing record of the accelerometer, which is used instead of a new calibration");
  log.add_flag("--fit-gyroscope-bias", command.fit_gyroscope_bias,
               "fit the gyroscope's bias to the turns instead of the rests, for a bias that varies "
               "during the log");
  log.add("--accelerometer-unit", command.accelerometer_unit, "UNIT",
          "unit of the accelerometer's readings");
  log.add("--gyroscope-unit", command.gyroscope_unit, "UNIT", "unit of the gyroscope's readings");
  log.add("--magnetometer-unit", command.magnetometer_unit, "UNIT",
          "unit of the magnetometer's readings");
  log.add("--magnetic-magnitude", command.magnetic_magnitude, "F",
          "magnitude of the local magnetic field [nT] [default: computed from --latitude and "
          "--longitude, otherwise 1]");
  options.add("--limits", command.limits, "FILE",
              "file of limits by which a unit is accepted or rejected; a rejected unit gives exit "
              "status 1");
  options.add("--history", command.history, "FOLDER",
              "earlier records of the same unit, or of its model if --model is given (a folder, a "
              ".jsonl file or a store); they show how biases change between blocks");
  options.add_flag("--each", command.each,
                   "each file is a unit with its own record; -o must contain {file} or {serial}. "
                   "Without --each the files are blocks of one unit");
  options.add("--calibrated", command.calibrated, "DATE",
              "date (ISO 8601) of the readings, if the file lacks the columns 'time' and 'date'");
  options.add(
      "--table", command.table, "FILE",
      "write a table of many units (column 'serial'): one row per unit, with verdict and reason");
  options.add_flag(
      "--stream", command.stream,
      "calibrate many units in constant memory: a unit is a group of rows with one 'serial', or "
      "one JSON line; -o RECORDS.jsonl[.zst] contains one line per unit, --table one row per unit");
  options.add("--shard", command.shard, "I/N",
              "with --stream: calibrate only part I of N of the units, chosen by a hash of the "
              "serial number; `axiscal merge` joins the parts");
  options.add_flag("--resume", command.resume,
                   "with --stream: keep the complete lines of the outputs, and continue after "
                   "them");
  options.add("--serial-from", command.serial_from, "FILE",
              "read the serial number from the first line of a file or device, for example a "
              "barcode scanner");
  options.add("--store", command.store, "STORE",
              "also store the records in a database: FILE.db (SQLite), or "
              "postgresql://USER@HOST/DATABASE; see `axiscal store`");
  options.add("--station", command.station, "NAME",
              "with --store: name of the station that took "
              "the readings");
  options.add("--batch", command.batch, "NAME", "with --store: batch of the units");
  options.add_flag("--accept-suggestion", command.accept_suggestion,
                   "correct the most likely mistake in the readings, or leave out the wrong "
                   "reading; the record contains a note of the change");
  options.add_flag("--force", command.force, "store the record even if it is refused");
}

constexpr std::string_view slot_place = "{slot}";
constexpr std::string_view serial_place = "{serial}";
constexpr std::string_view file_place = "{file}";
constexpr std::string_view instance_place = "{instance}";

// Replaces the placeholder `place` in `path` by `name`.
// @param how  text for the message: the options and columns that can state the name.
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
    throw UsageError(
        formatted("-o: '{}' contains {}, but the name to put there is unknown: "
                  "{}",
                  pattern, place, how));
  }
  if (name.find('/') != std::string::npos) {
    throw UsageError(formatted("-o: '{}' cannot be part of a file's name", name));
  }
  path.replace(at, place.size(), name);
}

// Returns the file name of a record: the pattern with `{slot}`, `{serial}`, `{file}` and
// `{instance}` replaced.
std::string output_for(const std::string& pattern,
                       const std::string& slot,
                       const std::string& serial,
                       int instance = 0,
                       const std::string& file = "") {
  std::string path = pattern;
  put_name(path, pattern, file_place, file, "without --each, all files together make one record");
  put_name(path, pattern, instance_place, std::to_string(instance), "");
  put_name(path, pattern, slot_place, slot,
           "name the slot in the columns (SLOT.axis) or with "
           "--slot");
  put_name(path, pattern, serial_place, serial,
           "give the serial number in a column 'serial' or "
           "with --serial");
  return path;
}

// Checks the output files before the calibration, because a later error would waste its result.
void check_output(const std::string& output, const Experiment& experiment, const Run& run) {
  if (run.slots.size() > 1 && output != "-" && output.find(slot_place) == std::string::npos) {
    throw UsageError(
        formatted("-o: the run has {} slots, each with its own record; the file name must contain "
                  "{{slot}}",
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

// Returns the records as JSON. One record is an object; several records are an array of objects.
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

// Rotates the calibration to the frame of another instrument that was recorded at the same time.
// @param record        file name of the other instrument's record, for messages.
// @param companion     calibration of the other instrument.
// @param companions    readings of the other instrument.
void align(const std::string& record,
           const Calibration& companion,
           const Observations& own,
           const Observations& companions,
           std::vector<Calibration>& calibrations) {
  if (calibrations.size() != 1) {
    throw UsageError("--align: requires readings of one instrument, not of several slots");
  }
  try {
    align_with_companion(calibrations.front(), own, companion, companions, record);
  } catch (const SetupError&) {
    throw;
  } catch (const DomainError& error) {
    throw DataError(record, error.what(), error.settings());
  }
}

// Returns the verdict on an instrument in one line, for the log of a factory.
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

// The outcome of a calibration, for all records of a run.
struct Outcome {
  bool refused = false;
  bool stored_refused = false;
  bool failed = false;        // true if a limit is not met, or a confirmation reading disagrees
  std::string refused_slots;  // message: "refused", or with slots "refused: slot A, B"
  std::string text;
};

bool is_refused(const Calibration& calibration) {
  return calibration.findings.status == CalibrationStatus::refused;
}

// Returns true if a record may be written to a file. A refused record is written only with --force.
bool may_be_stored(const CalibrateCommand& command, bool refused) {
  return !refused || command.force;
}

Outcome store(const CalibrateCommand& command, const std::vector<Calibration>& calibrations) {
  Outcome outcome{.refused_slots = "refused"};
  std::optional<StoreWriter> database;
  if (command.store) {
    database.emplace(*command.store);
  }
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
    outcome.text += summary(calibration, command.all ? SummaryDetail::full : SummaryDetail::brief,
                            SummaryEnd::fit);
    if (database) {  // unlike an output file, the store always accepts refused records
      database->write(stored_line(calibration_json(calibration, JsonLayout::one_line),
                                  command.station.value_or(""), command.batch.value_or("")));
    }
    if (command.output && *command.output != "-" && may_be_stored(command, refused)) {
      const std::string path =
          output_for(*command.output, calibration.provenance.slot,
                     calibration.sensor.instrument.serial, calibration.provenance.instance);
      write(calibration, path, Force::yes);
      outcome.stored_refused = outcome.stored_refused || refused;
      outcome.text += formatted("\nrecord: {}\n", path);
    }
  }
  if (database) {
    database->finish();
  }
  return outcome;
}

// Returns the scatter of the biases between blocks, estimated from earlier records; nullopt without
// --history.
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
    throw UsageError("--history: identify the unit with --serial, --model or a column 'serial'");
  }
  return process_scatter(earlier, unit, run.inputs);
}

Suggestions suggestions_of(const CalibrateCommand& command) {
  return command.accept_suggestion ? Suggestions::accept : Suggestions::name;
}

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
  if ((command.output && may_be_stored(command, refused)) || command.store) {
    try {
      unit.record =
          calibration_json(calibration, command.stream ? JsonLayout::one_line : JsonLayout::lines);
    } catch (const DomainError& error) {  // readers would refuse the record
      unit.result = "error";
      unit.reason = error.what();
    }
  }
}

}  // namespace

Unit calibrate_unit(const CalibrateCommand& command,
                    const Experiment& experiment,
                    const Run& run,
                    const std::string& serial,
                    const std::optional<Limits>& limits,
                    const std::vector<Calibration>& earlier,
                    std::vector<std::string>& parameters) {
  Unit unit{.serial = run.serial};
  try {
    Experiment own = experiment;
    own.instrument.serial = serial;
    own.fit.process = process_of(command, earlier, own, run);
    Run of_unit = run;
    of_unit.serial = serial;
    std::vector<Calibration> calibrations = calibrate_run(own, of_unit, suggestions_of(command));
    apply_limits(limits, calibrations);
    describe_unit(command, calibrations.front(), unit, parameters);
  } catch (const RefusedError& error) {
    unit.result = "error";
    unit.reason = with_options(error);
  }
  return unit;
}

bool is_good_result(std::string_view result) {
  return result == "pass" || result == "ok" || result == "warning";
}

std::string refusal_json(const Unit& unit, const std::string& sha256) {
  return nlohmann::ordered_json{{"format", "axiscal-refusal"}, {"version", 1},
                                {"serial", unit.serial},       {"sha256", sha256},
                                {"result", unit.result},       {"reason", unit.reason}}
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string table_header(const std::vector<std::string>& parameters) {
  std::string text = "serial,result,reason";
  for (const std::string& parameter : parameters) {
    text += formatted(",{},{}", formula_safe_cell(parameter), formula_safe_cell("u_" + parameter));
  }
  return text + "\n";
}

std::string table_row(const Unit& unit, std::size_t parameters) {
  std::string text = formatted("{},{},{}", formula_safe_cell(unit.serial), unit.result,
                               formula_safe_cell(unit.reason));
  for (std::size_t cell = 0; cell < 2 * parameters; ++cell) {
    text += "," + (cell < unit.cells.size() ? number_text(unit.cells[cell]) : "");
  }
  return text + "\n";
}

namespace {

// The results of several instruments (units), which one thread calibrates in sequence.
struct UnitsAtOnce {
  std::vector<Unit> units;
  std::vector<std::string> parameters;  // names of the first unit's parameters
};

// The instruments (units) of a batch.
struct Batch {
  UnitsOfRun units;                            // named by serial or, with --each, by file
  std::map<std::string, std::string> serials;  // serials of units named after files

  [[nodiscard]] const std::string& serial(const std::string& name) const {
    const auto found = serials.find(name);
    return found == serials.end() ? name : found->second;
  }

  // Returns the file name of the record of a unit.
  [[nodiscard]] std::string output(const std::string& pattern, const std::string& name) const {
    return output_for(pattern, "", serial(name), 0, name);
  }
};

// Names the unit of each file. The name is the serial number if -o contains {serial} or the file
// has several units; otherwise it is the name of the file.
// @return the serial numbers of the units that are named after their files.
std::map<std::string, std::string> name_units_by_files(const std::string& output,
                                                       std::vector<Run>& files) {
  std::map<std::string, std::string> serials;
  for (Run& file : files) {
    if (has_several_units(file) || output.find(serial_place) != std::string::npos) {
      if (file.serial.empty()) {
        throw UsageError(formatted(
            "--each: {} lacks the column 'serial'; use {{file}}, the name of the file, in -o",
            file.inputs.front().path));
      }
      continue;
    }
    const std::string name = std::filesystem::path(file.inputs.front().path).stem().string();
    if (!serials.emplace(name, file.serial).second) {
      throw UsageError(formatted("--each: two files are called '{}'", name));
    }
    file.serials.assign(file.observations.readings.size(), name);
    file.serial = name;
  }
  return serials;
}

// Adds a warning to a unit if it has fewer readings than most units.
// @param usual  number of readings of most units.
// @param place  index of the unit in the batch.
void mark_short_unit(const Batch& batch, std::size_t usual, std::size_t place, Unit& unit) {
  const std::size_t count = batch.units.readings(place);
  if (count >= usual) {
    return;
  }
  unit.result = unit.result == "ok" ? "warning" : unit.result;
  unit.reason = formatted("only {} readings, but most units have {}{}{}", count, usual,
                          unit.reason.empty() ? "" : "; ", unit.reason);
}

// Returns the results of a batch as a CSV table with one row per unit.
std::string table_of(const std::vector<Unit>& units, const std::vector<std::string>& parameters) {
  std::string text = table_header(parameters);
  for (const Unit& unit : units) {
    text += table_row(unit, parameters.size());
  }
  return text;
}

// Returns true if the name of the output file contains a placeholder that differs from unit to
// unit.
bool has_place_of_unit(const CalibrateCommand& command) {
  return command.output &&
         (command.output->find(serial_place) != std::string::npos ||
          (command.each && command.output->find(file_place) != std::string::npos));
}

// Checks before the calibration that the output files differ from each other and from the input
// files.
void check_outputs(const CalibrateCommand& command, const Batch& batch) {
  const UnitsOfRun& units = batch.units;
  if (command.output && units.size() > 1 && !has_place_of_unit(command)) {
    throw UsageError(formatted(
        "-o: the readings come from {} units, each with its own record; the file name must "
        "contain {}",
        units.size(), command.each ? "{file} or {serial}" : "{serial}"));
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
    add(batch.output(*command.output, units.serial(i)));
  }
}

// Calibrates many instruments (units). Prints one line per unit with its result and, for a failure,
// the reason; then prints the yield.
int run_batch(const CalibrateCommand& command,
              const Experiment& experiment,
              Run run,
              std::map<std::string, std::string> serials,
              const std::optional<Limits>& limits,
              const std::vector<Calibration>& earlier) {
  if (!command.table && !command.store && !has_place_of_unit(command)) {
    throw UsageError(
        command.each
            ? "--each: give -o with {file} or {serial} for one record per file, or --table FILE "
              "for one row per file"
            : "the readings are of several units (column 'serial'): give -o with {serial} for one "
              "record per unit, or --table FILE for one row per unit");
  }
  std::optional<StoreWriter> database;
  std::string inputs;  // SHA-256 of the input files, separated by blanks
  if (command.store) {
    database.emplace(*command.store);
    inputs = digests_of(run.inputs);
  }
  if (command.output == "-" || command.align || command.json) {
    throw UsageError(
        "-o -, --json and --align cannot be combined with several units; use -o with {serial} or "
        "{file}, or --table");
  }
  std::vector<Unit> units;
  std::vector<std::string> parameters;
  std::string text;
  std::size_t good = 0;
  std::optional<Batch> all(Batch{.units = UnitsOfRun(std::move(run), experiment.instrument.serial),
                                 .serials = std::move(serials)});
  check_outputs(command, *all);
  const std::size_t usual = all->units.usual_readings();
  // Each record is written as soon as it is made, because thousands of records would fill the
  // memory. The order of the records is that of the units.
  constexpr std::size_t at_once = 16;
  std::size_t begin = 0;
  const auto next = [&]() -> std::optional<std::function<UnitsAtOnce()>> {
    if (begin == all->units.size()) {
      return std::nullopt;
    }
    const std::size_t first = begin;
    begin = std::min(first + at_once, all->units.size());
    return [&, first, last = begin] {
      UnitsAtOnce piece;
      for (std::size_t i = first; i < last; ++i) {
        piece.units.push_back(calibrate_unit(command, experiment, all->units[i],
                                             all->serial(all->units.serial(i)), limits, earlier,
                                             piece.parameters));
      }
      return piece;
    };
  };
  for_each_in_order<UnitsAtOnce>(next, [&](UnitsAtOnce piece) {
    if (parameters.empty()) {
      parameters = std::move(piece.parameters);
    }
    for (Unit& unit : piece.units) {
      mark_short_unit(*all, usual, units.size(), unit);
      const std::string record = std::move(unit.record);  // moved to free the memory early
      if (!record.empty() && command.output && may_be_stored(command, unit.result == "refused")) {
        write_whole_file(all->output(*command.output, unit.serial), record);
      }
      if (database) {
        database->write(
            stored_line(record.empty() ? refusal_json(unit, inputs) : in_one_line(record),
                        command.station.value_or(""), command.batch.value_or("")));
      }
      good += is_good_result(unit.result) ? 1U : 0U;
      text +=
          formatted("{}: {}{}\n", unit.serial.empty() ? std::string("(no serial)") : unit.serial,
                    unit.result, unit.reason.empty() ? "" : ": " + unit.reason);
      units.push_back(std::move(unit));
    }
  });
  if (database) {
    database->finish();
  }
  all.reset();  // frees memory for the table
  text += formatted("yield: {} of {} ({:.1f} %)\n", good, units.size(),
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
  // Without -o the summary is the only result, so it is printed even with --quiet.
  const bool prints_summary = !is_quiet() || !command.output;
  if (command.output == "-" && may_be_stored(command, outcome.refused)) {
    write_whole_file("-", records_text(calibrations));
    outcome.stored_refused = true;
  } else if (command.output != "-") {
    if (command.json) {
      print_result_text(records_text(calibrations));
    } else if (prints_summary) {
      print_result_text(outcome.text);
    }
  }
  print_remarks(calibrations);
  for (const Calibration& calibration : calibrations) {
    if (calibration.findings.verdict) {
      print_line(verdict_line(calibration));
    }
  }
  if (command.output != "-" && !command.json && prints_summary) {
    std::for_each(calibrations.begin(), calibrations.end(), print_verdict);
  }
  if (outcome.refused) {
    print_error(formatted("axiscal: {}{}\n", outcome.refused_slots,
                          outcome.stored_refused
                              ? "; the refused record is stored because of --force"
                              : "; the record is not stored (use --force to store it)"));
    return 1;
  }
  return outcome.failed ? 1 : 0;
}

namespace {

// The columns of a table that contain the readings, and the sensor to which they belong.
struct AxesOfTable {
  std::string axes;  // for example "ax,ay,az"; empty: the names x, y, z
  std::optional<LogSensor> sensor;
  std::string words;  // note for the user: how the axes and the instrument were recognised
};

AxesOfTable axes_of_table(const TableText& text, const ExperimentOptions& options) {
  const auto has = [&](const std::string& name) {
    return std::any_of(text.columns().begin(), text.columns().end(), [&](const NamedColumn& one) {
      return to_lower_case(one.name) == name || one.name.ends_with("." + name);
    });
  };
  AxesOfTable found;
  found.sensor = sensor_of_kind(text, options.instrument.value_or(""));
  if (has("x") && has("y") && has("z")) {
    return found;
  }
  if (found.sensor) {
    found.axes = joined({found.sensor->columns.begin(), found.sensor->columns.end()}, ",");
    found.words = found.sensor->words;
    return found;
  }
  // If the table has labels of poses, all its other columns of numbers are axes. If it has no
  // labels, but exactly three unnamed columns, these are the axes.
  std::vector<std::string> header;
  for (const NamedColumn& one : text.columns()) {
    header.push_back(one.name);
  }
  const std::vector<std::string> others = unknown_columns(header);
  const bool has_labels = others.size() < header.size() &&
                          std::any_of(header.begin(), header.end(), [&](const std::string& name) {
                            return is_label_of_pose(name);
                          });
  std::vector<std::string> axes;
  // If the table has only some of x, y and z, the reader reports the missing columns.
  const bool has_some = has("x") || has("y") || has("z");
  for (std::size_t c = 0; c < header.size() && has_labels && !has_some; ++c) {
    const std::vector<double>& values = text.first_rows()[c];
    const bool are_numbers =
        !values.empty() &&
        std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
    if (are_numbers && std::find(others.begin(), others.end(), header[c]) != others.end()) {
      axes.push_back(header[c]);
    }
  }
  constexpr std::size_t usual = 3;
  if (!has_labels && !has_some && text.unnamed_numbers().size() == usual) {
    axes = text.unnamed_numbers();
  }
  if (!axes.empty() && axes.size() <= usual) {
    found.axes = joined(axes, ",");
    found.words = formatted("the axes are taken from the columns {}", joined(axes));
  }
  return found;
}

// Sets the kind of field if the table has a column with the magnitude of a known field.
void take_field_of_table(const TableText& text, ExperimentOptions& options) {
  for (const NamedColumn& one : text.columns()) {
    const std::string name = to_lower_case(one.name);
    if (!options.field && options.instrument == "gyroscope" &&
        (name.starts_with("rate") || name == "omega")) {
      options.field = "induced_rotation";
      const std::optional<KnownUnit> unit = known_unit(one.unit, SeriesKind::gyroscope);
      if (unit && !options.field_unit) {
        options.field_unit = std::string(unit->name);
      }
    }
    if (!options.field && options.instrument == "optical" &&
        (name == "lux" || name == "illuminance" || name == "irradiance")) {
      options.field = "light";
    }
  }
}

// Returns true if the readings were taken by turning the instrument by hand. The poses are then
// unknown, so only the magnitude of the field can be used.
bool by_magnitude(const ExperimentOptions& options) {
  return options.method == "magnitude";
}

std::vector<SeriesKind> recording_for(const ExperimentOptions& options) {
  return by_magnitude(options) ? kinds_of(options.instrument.value_or(""))
                               : std::vector<SeriesKind>();
}

// Returns the units that the header states for the columns of the axes. A column without a unit
// gives an empty text.
std::set<std::string> units_of_axes(const TableText& text, const ExperimentOptions& options) {
  const std::vector<std::string> axes =
      options.axes ? names_of(*options.axes) : std::vector<std::string>{"x", "y", "z"};
  std::set<std::string> units;
  for (const std::string& axis : axes) {
    for (const NamedColumn& one : text.columns()) {
      if (to_lower_case(one.name) == to_lower_case(axis)) {
        units.insert(one.unit);
      }
    }
  }
  return units;
}

// Returns true if two different units measure the same quantity. If a unit is unknown, the two
// units measure the same quantity only if they differ by a prefix, such as V and mV.
bool are_of_one_quantity(std::string_view a, std::string_view b, SeriesKind kind) {
  const std::optional<KnownUnit> known_a = known_unit(a, kind);
  const std::optional<KnownUnit> known_b = known_unit(b, kind);
  if (known_a && known_b) {
    return known_a->name != known_b->name && known_a->kind == known_b->kind;
  }
  const auto base = [](std::string_view unit) {
    const bool has_prefix =
        unit.size() > 1 && std::string_view("munkM").find(unit.front()) != std::string_view::npos;
    return unit.substr(has_prefix ? 1 : 0);
  };
  return a != b && !a.empty() && base(a) == base(b);
}

// Sets axes, instrument, field and units from the columns of the first table, if the options do not
// state them.
ExperimentOptions with_columns_of_table(ExperimentOptions options, const TableOptions& table) {
  const std::string path = options.files.front();
  if (is_experiment_file(path) || !can_be_read_again(path) || states_slots(options)) {
    return options;
  }
  LogFormat format = format_of(table);
  format.kinds = recording_for(options);
  format.wanted = names_of(options.axes.value_or(""));
  const TableText text(path, format);
  if (text.columns().empty()) {
    return options;
  }
  take_field_of_table(text, options);
  const AxesOfTable found = options.axes ? AxesOfTable{} : axes_of_table(text, options);
  const std::optional<LogSensor>& sensor = found.sensor;
  if (!found.axes.empty()) {
    options.axes = found.axes;
  }
  if (!found.words.empty() || (sensor && !options.instrument)) {
    print_remark("note", path + ": " + (found.words.empty() ? sensor->words : found.words));
  }
  if (sensor && !options.instrument && !sensor->is_guess) {
    options.instrument = name_of(sensor->kind);
  } else if (sensor && !options.instrument) {
    throw UsageError(formatted(
        "the kind of instrument is missing; the numbers look like readings of this kind: {}. If "
        "this is right, use --instrument {}",
        name_of(sensor->kind), name_of(sensor->kind)));
  }
  const std::set<std::string> units = units_of_axes(text, options);
  const SeriesKind kind = sensor ? sensor->kind : SeriesKind::other;
  for (const std::string& unit : units) {
    if (options.unit && are_of_one_quantity(unit, *options.unit, kind)) {
      throw UsageError(
          formatted("--unit: the columns of the axes are in {}, not in {}. Give --unit {}, or "
                    "convert the readings",
                    unit, *options.unit, unit));
    }
  }
  if (!options.unit) {
    std::string note;
    if (units.size() == 1 && !units.begin()->empty()) {
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

// Returns the first line that is not empty. The file may be a device, for example a barcode
// scanner.
std::string scanned_serial(const std::string& path) {
  std::string serial;
  InputFile file(path);
  for (char c = '\0'; file.read(&c, 1) == 1 && (c != '\n' || serial.empty());) {
    serial += c == '\n' || c == '\r' ? "" : std::string(1, c);
  }
  serial = trimmed(serial);
  if (serial.empty()) {
    throw DataError(path, "the file contains no serial number (--serial-from)");
  }
  return serial;
}

int run(const CalibrateCommand& command) {
  if (command.serial_from) {
    if (command.experiment.serial) {
      throw UsageError("--serial-from: cannot be combined with --serial");
    }
    CalibrateCommand scanned = command;
    scanned.serial_from.reset();
    scanned.experiment.serial = scanned_serial(*command.serial_from);
    return run(scanned);
  }
  if (command.experiment.method == "attitude") {
    return run_attitude(command);
  }
  if (command.body || command.tare) {
    throw UsageError("--body, --tare: require --method attitude");
  }
  if (command.calibrated) {
    static_cast<void>(calibrated_of_option(*command.calibrated));
  }
  if (command.experiment.files.empty() && !command.imu) {
    throw UsageError("calibrate: requires FILEs of readings, or --imu LOG");
  }
  if (command.imu) {
    return run_imu(command);
  }
  const TableOptions& table = command.rests.log.table;
  if (command.stream) {
    CalibrateCommand stream = command;
    stream.experiment = with_columns_of_table(command.experiment, table);
    return run_stream(stream, table);
  }
  if (command.shard || command.resume) {
    throw UsageError("--shard, --resume: require --stream");
  }
  const std::vector<std::string> of_logs = stated_options_of(command.rests);
  if (!of_logs.empty()) {
    throw UsageError(
        formatted("calibrate: {} {} only for a log (--imu), not for tables of readings; for a "
                  "table, name the axes with --axes, and columns without a header with --names",
                  joined(of_logs), of_logs.size() == 1 ? "is" : "are"));
  }
  ExperimentFile file = make_experiment_file(with_columns_of_table(command.experiment, table));
  Experiment& experiment = file.experiment;
  const std::string limits_path = command.limits.value_or(file.paths.limits);
  const std::optional<Limits> limits =
      limits_path.empty() ? std::nullopt : std::optional(read_limits(limits_path));
  const std::vector<Calibration> earlier =
      command.history ? read_records(named_records(*command.history)) : std::vector<Calibration>{};
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
  std::vector<Run> files =
      read_files(file, Units::several,
                 {.options = table,
                  .faces_of = experiment.slots.empty() ? experiment.instrument.kind : "",
                  .of_recording = by_magnitude(command.experiment) && experiment.slots.empty()
                                      ? experiment.instrument.kind
                                      : ""},
                 beside, &companions);
  std::map<std::string, std::string> serials;
  if (command.each) {
    serials = name_units_by_files(command.output.value_or(""), files);
  }
  Run run = join_runs(std::move(files), Units::several);
  run.measured = command.calibrated ? calibrated_of_option(*command.calibrated) : "";
  experiment.positioner =
      with_assembly(experiment.positioner, command.experiment.assembly, run.slots);
  experiment.slot = slot_of(experiment, run);
  if (has_several_units(run) || command.table || command.each) {
    return run_batch(command, experiment, std::move(run), std::move(serials), limits, earlier);
  }
  restore_count_signs(run);
  const bool may_be_samples =
      experiment.slots.empty() &&
      (!experiment.fit.method || method_kind(*experiment.fit.method).by_magnitude);
  const bool is_of_rests = may_be_samples && gather_rests(experiment.instrument.kind, run);
  if (is_of_rests) {
    // The noise of the mean over a period at rest is usually smaller than the errors of the
    // sensor's model, so all these means get equal weights instead of weights from their noise.
    experiment.fit.weighting = experiment.fit.weighting.value_or(Weighting::none);
  }
  if (is_of_rests && !experiment.fit.method && experiment.instrument.kind == "accelerometer" &&
      run.observations.response.cols() == 3) {
    label_faces(run);
  }
  if (!command.force && run.serial.empty() && experiment.instrument.serial.empty()) {
    require_one_instrument(experiment, run);
  }
  experiment.fit.process = process_of(command, earlier, experiment, run);
  if (command.history && !experiment.fit.process) {
    print_remark("note", *command.history +
                             ": there are no earlier records of the unit here, so the changes of "
                             "the biases between blocks are unknown");
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
  return make_subcommand<CalibrateCommand>(
      "calibrate", "calibrate an instrument from labelled readings, or from a log", "",
      &add_options, &run);
}

}  // namespace axiscal::cli
