// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <iterator>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/logs/regions.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/logs/time_column.hpp"
#include "calibrate_command.hpp"
#include "column_advice.hpp"
#include "core/formatted.hpp"
#include "core/redirected_streams.hpp"
#include "input.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

std::string rests_text(const ImuCalibration& imu) {
  const Segmentation& rests = imu.rests;
  std::string text =
      formatted("{} rests found in {:.1f} s at {:.5g} Hz; variance threshold for rest {:.4g}\n",
                rests.intervals.size(), static_cast<double>(rests.samples) / rests.rate_hz,
                rests.rate_hz, rests.threshold);
  if (imu.turns) {
    text +=
        formatted("{} turns, attitude error {:.3g} degrees (standard deviation about each axis)\n",
                  imu.turns->residuals.size(), imu.turns->residual_sd_rad * deg_per_rad);
  }
  return text;
}

ImuOptions options_of(const CalibrateCommand& command) {
  ImuOptions options = imu_options_of(command.rests, {"ax", "ay", "az"});
  ExperimentOptions experiment = command.experiment;
  experiment.files.clear();  // the files are further logs, not experiments
  if (command.accelerometer_unit) {
    if (experiment.unit && *experiment.unit != *command.accelerometer_unit) {
      throw UsageError(
          "--unit, --accelerometer-unit: both set the unit of the same readings; give only one");
    }
    experiment.unit = command.accelerometer_unit;
  }
  if (experiment.instrument && *experiment.instrument != "accelerometer") {
    throw UsageError(
        "--instrument: cannot be combined with --imu, which calibrates accelerometer, gyroscope "
        "and magnetometer");
  }
  experiment.instrument = "accelerometer";
  experiment.field = experiment.field.value_or("gravity");
  if (experiment.axes) {
    throw UsageError(
        "--axes: cannot be combined with --imu; use --accelerometer X,Y,Z, --gyroscope X,Y,Z and "
        "--magnetometer X,Y,Z");
  }
  options.experiment = make_experiment(experiment);
  if (options.experiment.instrument.range) {
    options.segment.range = options.experiment.instrument.range;
  }
  options.gyroscope_unit = command.gyroscope_unit.value_or("1");
  options.magnetometer_unit = command.magnetometer_unit.value_or("1");
  options.turns.fit_bias = command.fit_gyroscope_bias;
  if (command.magnetic_magnitude) {
    options.magnetic_field.magnitude =
        parse_positive("--magnetic-magnitude", *command.magnetic_magnitude);
  }
  if (command.cube && command.rests.plan) {
    throw UsageError("--cube: cannot be combined with --plan, which already gives the seats");
  }
  if (command.cube) {
    options.seats = Seats::recognised;
  }
  return options;
}

// Returns true if the user wants the record of this slot.
bool is_wanted(const CalibrateCommand& command, const std::string& slot) {
  if (!command.only) {
    return true;
  }
  const std::vector<std::string> wanted = names_of(*command.only);
  return std::find(wanted.begin(), wanted.end(), slot) != wanted.end();
}

void check_only(const CalibrateCommand& command) {
  for (const std::string& slot : names_of(command.only.value_or("accelerometer"))) {
    if (slot != "accelerometer" && slot != "gyroscope" && slot != "magnetometer") {
      throw UsageError(
          formatted("--only: '{}' must be accelerometer, gyroscope or magnetometer", slot));
    }
  }
}

const LogSensor* sensor_of(const LogInput& input, const Calibration& record) {
  return input.sensor(record.provenance.slot == "accelerometer" ? SeriesKind::accelerometer
                      : record.provenance.slot == "gyroscope"   ? SeriesKind::gyroscope
                                                                : SeriesKind::magnetometer);
}

// Text for the error message if the columns of an instrument are missing in the log.
struct LackingInstrument {
  // option that names the columns
  std::string_view option = "--accelerometer";
  // word that the names of the columns usually contain
  std::string_view word = "acc";
};

LackingInstrument lacking_instrument(const RecordedLog& log, const ImuOptions& options) {
  const auto lacks = [&](const std::vector<std::string>& columns) {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const std::string& name) { return !find_column(log.columns, name); });
  };
  return lacks(options.accelerometer)  ? LackingInstrument{}
         : lacks(options.gyroscope)    ? LackingInstrument{"--gyroscope", "gyr"}
         : lacks(options.magnetometer) ? LackingInstrument{"--magnetometer", "mag"}
                                       : LackingInstrument{};
}

}  // namespace

namespace {

constexpr std::string_view place_of_instance = "{instance}";

// Returns the factor from a gyroscope's unit to rad/s; nullopt if the unit is unknown.
std::optional<double> rate_per_unit(const std::string& unit) {
  const std::optional<KnownUnit> known = known_unit(unit, SeriesKind::gyroscope);
  return known && known->kind == SeriesKind::gyroscope ? std::optional(known->si) : std::nullopt;
}

std::vector<std::string> columns_of(const LogSensor& sensor) {
  return {sensor.columns.begin(), sensor.columns.end()};
}

// Sets columns, units and times to those of the log's sensors, if the options do not state them.
void take_sensors(const CalibrateCommand& command, const LogInput& input, ImuOptions& options) {
  const RestOptions& rests = command.rests;
  const auto take = [&](SeriesKind kind, const std::optional<std::string>& option,
                        std::vector<std::string>& columns, const std::optional<std::string>& unit,
                        std::string& to) -> const LogSensor* {
    const LogSensor* const sensor = input.sensor(kind);
    if (sensor == nullptr) {
      return nullptr;
    }
    if (!option) {
      columns = columns_of(*sensor);
    }
    if (columns != columns_of(*sensor)) {
      return nullptr;
    }
    if (!unit && !sensor->unit.empty()) {
      to = sensor->unit;
    }
    return sensor;
  };
  take(SeriesKind::accelerometer, rests.accelerometer, options.accelerometer,
       command.experiment.unit, options.experiment.instrument.unit);
  const LogSensor* const gyroscope = take(SeriesKind::gyroscope, rests.gyroscope, options.gyroscope,
                                          command.gyroscope_unit, options.gyroscope_unit);
  take(SeriesKind::magnetometer, rests.magnetometer, options.magnetometer,
       command.magnetometer_unit, options.magnetometer_unit);
  if (gyroscope != nullptr && !options.turns.rate_per_unit) {
    options.turns.rate_per_unit = rate_per_unit(options.gyroscope_unit);
  }
  if (options.segment.time.empty() && !options.segment.rate_hz) {
    options.segment.time = input.time;
    if (input.time.empty()) {
      options.segment.rate_hz = input.stated_rate_hz;
    }
  }
}

// Reads the record of --accelerometer-record. The readings in the record must have the same unit as
// the readings in the log.
Calibration known_accelerometer_of(const CalibrateCommand& command, const ImuOptions& options) {
  Calibration known = read_unrefused(*command.known_accelerometer, command.force);
  const std::string& unit = options.experiment.instrument.unit;
  if (known.sensor.instrument.axis_count() != 3 || !known.sensor.also.empty() ||
      known.sensor.field.kind != "gravity") {
    throw DataError(*command.known_accelerometer,
                    "this file must be the record of an accelerometer with three axes");
  }
  if (unit != "1" && known.sensor.instrument.unit != "1" && known.sensor.instrument.unit != unit) {
    throw DataError(
        *command.known_accelerometer,
        formatted("the readings of this record are in {}, but those of the log are in {}",
                  known.sensor.instrument.unit, unit));
  }
  return known;
}

// Returns the parts of the log in which the IMU was at rest or was rotated, as stated by the user.
// They are read from the file or column that --regions names. Without this option, they are read
// from the column `part`. The list is empty if the log has no such column.
std::vector<Region> regions_of(const CalibrateCommand& command, const LogInput& input) {
  if (command.rests.regions) {
    const bool is_file = command.rests.regions->ends_with(".json");
    return is_file ? read_regions(*command.rests.regions)
                   : read_region_column(*command.imu, *command.rests.regions);
  }
  if (input.has_parts) {
    print_remark("note",
                 "the rests and turns are taken from the column 'part', so the log is not searched "
                 "for them");
    return read_region_column(*command.imu, "part");
  }
  return {};
}

// Returns the time of the last sample in ISO 8601; empty if the times of the log are not dates.
std::string end_of_log(const LogInput& input) {
  const std::optional<std::size_t> column = find_column(input.log.columns, input.time);
  if (!column || input.log.samples[*column].empty()) {
    return "";
  }
  const double last_s = seconds_of_clock(input.log.samples[*column].back());
  return is_utc(last_s) ? timestamp_of(last_s) : "";
}

// Returns the unit of three columns of acceleration, determined by the magnitude of gravity. The
// result is empty if no unit gives that magnitude.
std::string unit_of_columns(const RecordedLog& log, const std::vector<std::string>& names) {
  std::vector<const std::vector<double>*> columns;
  for (const std::string& name : names) {
    const std::optional<std::size_t> column = find_column(log.columns, name);
    if (column) {
      columns.push_back(&log.samples[*column]);
    }
  }
  return columns.size() == 3 ? unit_of_gravity(*columns[0], *columns[1], *columns[2]) : "";
}

// The records of the sensors that have the same instance number, and the sensors that could not be
// calibrated.
struct InstanceRecords {
  std::vector<Calibration> records;
  std::vector<FailedSensor> failed;
};

// Adapts the options if each file contains only one period at rest. This is assumed if the shortest
// file is less than twice as long as the shortest permitted period at rest. That limit then becomes
// 40 % of the length of the shortest file. The window is reduced to at most 20 % of this length,
// and the trim to at most 5 %.
void fit_rests_to_files(const LogInput& input, SegmentOptions& options) {
  if (input.begins.empty()) {
    return;
  }
  std::vector<std::size_t> ends = input.begins;
  ends.push_back(input.log.samples.front().size());
  std::size_t shortest = ends.back();
  std::size_t first = 0;
  for (const std::size_t end : ends) {
    shortest = std::min(shortest, end - first);
    first = end;
  }
  double rate_hz = options.rate_hz.value_or(0.0);
  if (!options.rate_hz) {
    const std::optional<TimeColumn> column =
        find_time_column(input.log.name, input.log.columns, options.time);
    if (!column) {
      return;
    }
    const std::vector<double>& times = input.log.samples[column->position];
    rate_hz = 1.0 / (usual_step(times) * settle_time_unit(input.log.name, *column, times).seconds);
  }
  const double span_s = static_cast<double>(shortest) / rate_hz;
  constexpr double usual_part = 2.0;
  if (span_s < usual_part * options.shortest_s) {
    options.shortest_s = 0.4 * span_s;
    options.window_s = std::min(options.window_s, 0.2 * span_s);
    options.trim_s = std::min(options.trim_s, 0.05 * span_s);
  }
}

// Calibrates the sensors of a log that have the same number (instance), for example its second
// accelerometer, gyroscope and magnetometer.
InstanceRecords calibrate_instance(const CalibrateCommand& command,
                                   const LogInput& input,
                                   int instance,
                                   const std::vector<InputFileDigest>& digests,
                                   std::string& heading) {
  CalibrateCommand own = command;
  const LogSensor* const accelerometer = input.sensor(SeriesKind::accelerometer);
  if (!own.experiment.unit && !own.accelerometer_unit) {
    // If an option names the columns, their unit is recognised by the magnitude of gravity.
    const std::string unit =
        command.rests.accelerometer
            ? unit_of_columns(input.log, names_of(*command.rests.accelerometer))
        : accelerometer != nullptr ? accelerometer->unit
                                   : std::string();
    if (command.rests.accelerometer && !unit.empty()) {
      print_remark("note",
                   formatted("the unit of the accelerometer's readings is taken as {}, because in "
                             "this unit their magnitude is that of gravity",
                             unit));
    }
    const std::string note = take_unit_of_file(unit, own.experiment);
    if (!note.empty()) {
      print_remark("note", note);
    }
  }
  ImuOptions options = options_of(own);
  take_sensors(command, input, options);
  if (!is_wanted(command, "gyroscope")) {
    options.gyroscope.clear();
  }
  if (!is_wanted(command, "magnetometer")) {
    options.magnetometer.clear();
  }
  options.segment.begins = input.begins;
  fit_rests_to_files(input, options.segment);
  if (command.known_accelerometer) {
    options.known_accelerometer = known_accelerometer_of(command, options);
  }
  const LackingInstrument lacking = lacking_instrument(input.log, options);
  const std::vector<Region> regions = regions_of(command, input);
  ImuCalibration imu = with_column_advice(lacking.option, lacking.word, [&] {
    return regions.empty() ? calibrate_imu(input.log, options)
                           : calibrate_regions(input.log, regions, options);
  });
  heading += rests_text(imu) + "\n";
  std::vector<Calibration> records = imu.records();
  std::erase_if(records, [&](const Calibration& record) {
    const LogSensor* const sensor = sensor_of(input, record);
    // If a kind has no sensor with this number, a sensor of the same kind with another number was
    // used. The record of that sensor is stored only in the call for its own number.
    return (instance > 0 && sensor != nullptr && sensor->number != instance) ||
           !is_wanted(command, record.provenance.slot);
  });
  const std::string measured =
      command.calibrated ? calibrated_of_option(*command.calibrated) : end_of_log(input);
  for (Calibration& record : records) {
    record.provenance.inputs = digests;
    record.provenance.measured = measured;
    for (const std::string& note : imu.notes) {
      record.findings.notes.push_back({NoteCode::input, note});
    }
    if (const LogSensor* const sensor = sensor_of(input, record)) {
      record.provenance.instance = sensor->number;
      record.provenance.device = sensor->device;
    }
  }
  return {.records = std::move(records), .failed = std::move(imu.failed)};
}

// Writes the records to the output files, then prints the sensors that could not be calibrated.
int deliver_of_log(const CalibrateCommand& command,
                   const std::vector<Calibration>& records,
                   const std::vector<FailedSensor>& failed,
                   const std::string& heading) {
  int status = 0;
  if (!records.empty()) {
    status = deliver_records(command, records, heading);
  }
  for (const FailedSensor& sensor : failed) {
    print_error(formatted("axiscal: {}: refused: {}\n", sensor.slot, sensor.message));
  }
  if (records.empty() && failed.empty()) {
    throw RefusedError("--only: the log contains none of the chosen sensors");
  }
  return failed.empty() ? status : 1;
}

}  // namespace

int run_imu(const CalibrateCommand& command) {
  if (command.align || command.limits || command.table || command.history ||
      command.accept_suggestion) {
    throw UsageError(
        "--imu: cannot be combined with --align (the three sensors are aligned anyway), --limits, "
        "--table, --history or --accept-suggestion; use `axiscal check` on the records");
  }
  check_only(command);
  std::vector<std::string> paths = {*command.imu};
  paths.insert(paths.end(), command.experiment.files.begin(), command.experiment.files.end());
  if (paths.size() > 1 && command.rests.regions) {
    throw UsageError("--regions: only one log can be given with this option");
  }
  static_cast<void>(
      options_of(command));  // reports errors of the command line before the log is read
  LogFormat format = format_of(command.rests.log, columns_named_by(command.rests));
  std::vector<InputFileDigest> digests;
  for (const std::string& path : paths) {
    digests.push_back({.path = path, .sha256 = sha256_of_file(path), .is_log = true});
  }
  const bool wants_all =
      command.output && command.output->find(place_of_instance) != std::string::npos;
  LogInput input = record_logs(paths, format);
  int instances = 1;
  for (const LogSensor& sensor : input.sensors) {
    instances = std::max(instances, sensor.of);
  }
  const auto wanted =
      std::count_if(input.sensors.begin(), input.sensors.end(), [&](const LogSensor& sensor) {
        return is_wanted(command, std::string(name_of(sensor.kind)));
      });
  if (command.output && *command.output != "-" && wanted > 1 &&
      command.output->find("{slot}") == std::string::npos) {
    throw UsageError(formatted(
        "-o: the log gives {} records, one for each sensor; write {{slot}} in the file name for "
        "the name of the sensor, as in imu-{{slot}}.json",
        wanted));
  }
  const bool has_usual =
      find_column(input.log.columns, "ax") && find_column(input.log.columns, "ay");
  if (!command.rests.accelerometer && !has_usual && !input.sensors.empty() &&
      input.sensor(SeriesKind::accelerometer) == nullptr) {
    std::string found;
    for (const LogSensor& sensor : input.sensors) {
      found += (found.empty() ? "" : "; ") + sensor.words;
    }
    throw DataError(*command.imu,
                    formatted("this log contains no accelerometer whose readings include gravity "
                              "and vary; its sensors are: {}. The linear acceleration of phones "
                              "excludes gravity: record the acceleration with gravity. To use "
                              "other columns, give --accelerometer X,Y,Z",
                              found));
  }
  std::vector<Calibration> records;
  std::vector<FailedSensor> failed;
  std::string heading;
  const bool chosen = command.rests.log.instance.has_value();
  const int first = chosen ? format.instance : 0;
  const int last = wants_all && !chosen ? instances - 1 : first;
  for (int instance = first; instance <= last; ++instance) {
    if (instance != first) {
      format.instance = instance;
      input = record_logs(paths, format);
    }
    InstanceRecords some =
        calibrate_instance(command, input, chosen ? 0 : instance, digests, heading);
    std::move(some.records.begin(), some.records.end(), std::back_inserter(records));
    std::move(some.failed.begin(), some.failed.end(), std::back_inserter(failed));
  }
  if (instances > 1 && last == first && !chosen && !records.empty()) {
    records.front().findings.notes.push_back(
        {NoteCode::input,
         formatted("the log has up to {} sensors of one kind; only the first of each kind is "
                   "calibrated (--instance N selects another sensor; {{instance}} in the file "
                   "name of -o selects all sensors)",
                   instances)});
  }
  return deliver_of_log(command, records, failed, heading);
}

}  // namespace axiscal::cli
