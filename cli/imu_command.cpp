// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/logs/regions.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "calibrate_command.hpp"
#include "column_advice.hpp"
#include "input.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

std::string rests_text(const ImuCalibration& imu) {
  const Segmentation& rests = imu.rests;
  std::string text =
      formatted("{} rests in {:.1f} s at {:.5g} Hz, threshold of the joined variance {:.4g}\n",
                rests.intervals.size(), static_cast<double>(rests.samples) / rests.rate_hz,
                rests.rate_hz, rests.threshold);
  if (imu.turns) {
    text += formatted("{} turns, attitude error {:.3g} degrees a component\n",
                      imu.turns->residuals.size(), imu.turns->residual_sd_rad * deg_per_rad);
  }
  return text;
}

ImuOptions options_of(const CalibrateCommand& command) {
  ImuOptions options = imu_options_of(command.rests, {"ax", "ay", "az"});
  ExperimentOptions experiment = command.experiment;
  if (experiment.instrument && *experiment.instrument != "accelerometer") {
    throw UsageError(
        "--instrument: with --imu it is the accelerometer, gyroscope and magnetometer");
  }
  experiment.instrument = "accelerometer";
  experiment.field = experiment.field.value_or("gravity");
  if (experiment.axes) {
    throw UsageError("--axes: with --imu the columns are --accelerometer X,Y,Z and the like");
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
        positive_of("--magnetic-magnitude", *command.magnetic_magnitude);
  }
  if (command.cube && command.rests.plan) {
    throw UsageError("--cube: goes without --plan, which states the seats");
  }
  if (command.cube) {
    options.seats = Seats::recognised;
  }
  return options;
}

const LogSensor* sensor_of(const LogInput& input, const Calibration& record) {
  return input.sensor(record.provenance.slot == "accelerometer" ? SeriesKind::accelerometer
                      : record.provenance.slot == "gyroscope"   ? SeriesKind::gyroscope
                                                                : SeriesKind::magnetometer);
}

// The instrument of which the log lacks a column: the option that names its columns, and what such
// columns have in their names.
struct LackingInstrument {
  std::string_view option = "--accelerometer";
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

// What a gyroscope's unit makes of a number [rad/s]; nothing where the unit is not known.
std::optional<double> rate_per_unit(const std::string& unit) {
  const std::optional<KnownUnit> known = known_unit(unit, SeriesKind::gyroscope);
  return known && known->kind == SeriesKind::gyroscope ? std::optional(known->si) : std::nullopt;
}

std::vector<std::string> columns_of(const LogSensor& sensor) {
  return {sensor.columns.begin(), sensor.columns.end()};
}

// What the options leave open is taken from what the log says of its sensors.
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

// The record of the accelerometer, in the unit of the log.
Calibration known_accelerometer_of(const CalibrateCommand& command, const ImuOptions& options) {
  Calibration known = read_unrefused(*command.known_accelerometer, command.force);
  const std::string& unit = options.experiment.instrument.unit;
  if (known.sensor.instrument.axis_count() != 3 || !known.sensor.also.empty() ||
      known.sensor.field.kind != "gravity") {
    throw DataError(*command.known_accelerometer,
                    "must be the record of an accelerometer of three axes");
  }
  if (unit != "1" && known.sensor.instrument.unit != "1" && known.sensor.instrument.unit != unit) {
    throw DataError(*command.known_accelerometer,
                    formatted("is of readings in {}, and the log's are in {}",
                              known.sensor.instrument.unit, unit));
  }
  return known;
}

// The regions that are stated: by a file, or by a column of the log, which may be called `part`.
std::vector<Region> regions_of(const CalibrateCommand& command, const LogInput& input) {
  if (command.rests.regions) {
    const bool is_file = command.rests.regions->ends_with(".json");
    return is_file ? read_regions(*command.rests.regions)
                   : read_region_column(*command.imu, *command.rests.regions);
  }
  if (input.has_parts) {
    print_remark("note", "the column 'part' names rests and turns; they are taken as known");
    return read_region_column(*command.imu, "part");
  }
  return {};
}

// The records of one instance: of each kind the sensor of that number, where there is one.
std::vector<Calibration> calibrate_instance(const CalibrateCommand& command,
                                            const LogInput& input,
                                            int instance,
                                            const InputFileDigest& digest,
                                            std::string& heading) {
  CalibrateCommand own = command;
  const LogSensor* const accelerometer = input.sensor(SeriesKind::accelerometer);
  if (!own.experiment.unit && !command.rests.accelerometer && accelerometer != nullptr &&
      !accelerometer->unit.empty()) {
    const std::string note = take_unit_of_file(accelerometer->unit, own.experiment);
    if (!note.empty()) {
      print_remark("note", note);
    }
  }
  ImuOptions options = options_of(own);
  take_sensors(command, input, options);
  if (command.known_accelerometer) {
    options.known_accelerometer = known_accelerometer_of(command, options);
  }
  const LackingInstrument lacking = lacking_instrument(input.log, options);
  const std::vector<Region> regions = regions_of(command, input);
  ImuCalibration imu = advising_columns(lacking.option, lacking.word, [&] {
    return regions.empty() ? calibrate_imu(input.log, options)
                           : calibrate_regions(input.log, regions, options);
  });
  heading += rests_text(imu) + "\n";
  std::vector<Calibration> records = imu.records();
  std::erase_if(records, [&](const Calibration& record) {
    const LogSensor* const sensor = sensor_of(input, record);
    // A sensor that serves several others is stored once.
    return instance > 0 && sensor != nullptr && sensor->number != instance;
  });
  for (Calibration& record : records) {
    record.provenance.inputs = {digest};
    for (const std::string& note : imu.notes) {
      record.findings.notes.push_back({NoteCode::input, note});
    }
    if (const LogSensor* const sensor = sensor_of(input, record)) {
      record.provenance.instance = sensor->number;
      record.provenance.device = sensor->device;
    }
  }
  return records;
}

}  // namespace

int run_imu(const CalibrateCommand& command) {
  if (command.align || command.limits || command.table || command.history ||
      command.accept_suggestion) {
    throw UsageError(
        "--imu: goes without --align (the three are aligned), --limits, --table, --history and "
        "--accept-suggestion; check the records afterwards");
  }
  static_cast<void>(options_of(command));  // what is typed wrongly is said before the log is read
  LogFormat format = format_of(command.rests.log, columns_named_by(command.rests));
  const InputFileDigest digest{
      .path = *command.imu, .sha256 = sha256_of_file(*command.imu), .is_log = true};
  const bool wants_all =
      command.output && command.output->find(place_of_instance) != std::string::npos;
  LogInput input = record_log(*command.imu, format);
  int instances = 1;
  for (const LogSensor& sensor : input.sensors) {
    instances = std::max(instances, sensor.of);
  }
  if (command.output && *command.output != "-" && input.sensors.size() > 1 &&
      command.output->find("{slot}") == std::string::npos) {
    throw UsageError(formatted("-o: the log gives {} records; the file's name must hold {{slot}}",
                               input.sensors.size()));
  }
  const bool has_usual =
      find_column(input.log.columns, "ax") && find_column(input.log.columns, "ay");
  if (!command.rests.accelerometer && !has_usual && !input.sensors.empty() &&
      input.sensor(SeriesKind::accelerometer) == nullptr) {
    std::string found;
    for (const LogSensor& sensor : input.sensors) {
      found += (found.empty() ? "" : "; ") + sensor.words;
    }
    throw DataError(
        *command.imu,
        formatted("holds no accelerometer that feels gravity and varies: {}. What phones "
                  "call linear acceleration is without gravity: record the acceleration "
                  "with it. Other columns: --accelerometer X,Y,Z",
                  found));
  }
  std::vector<Calibration> records;
  std::string heading;
  const bool chosen = command.rests.log.instance.has_value();
  const int first = chosen ? format.instance : 0;
  const int last = wants_all && !chosen ? instances - 1 : first;
  for (int instance = first; instance <= last; ++instance) {
    if (instance != first) {
      format.instance = instance;
      input = record_log(*command.imu, format);
    }
    const std::vector<Calibration> some =
        calibrate_instance(command, input, chosen ? 0 : instance, digest, heading);
    records.insert(records.end(), some.begin(), some.end());
  }
  if (instances > 1 && last == first && !chosen) {
    records.front().findings.notes.push_back(
        {NoteCode::input,
         formatted("the log has {} sensors of a kind; these records are of the first (another: "
                   "--instance N; all of them: {{instance}} in the name of -o)",
                   instances)});
  }
  return deliver_records(command, records, heading);
}

}  // namespace axiscal::cli
