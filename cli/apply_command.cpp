// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>
#include <optional>
#include <vector>

#include "apply_records.hpp"
#include "axiscal/calib/body.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "core/formatted.hpp"
#include "core/temporary_file.hpp"
#include "input.hpp"
#include "json_lines.hpp"
#include "stored_record.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct ApplyCommand {
  std::string record;
  std::string readings;
  std::vector<std::string> more;  // arguments after the first two: more records, then the log
  std::string output = "-";
  std::optional<std::string> field_magnitude, field_unit, yaw_above, pitch;
  std::optional<std::string> attitude, declination, latitude, longitude, height, gravity_model;
  std::optional<std::string> noise, resolution, temperature_u;
  TableOptions table;
  std::optional<std::string> field_magnitude_u, level;
  StoredRecordOptions stored;
  std::optional<std::string> frame, body, joint, alarm, decimals;
  bool uncertainty = false;
  bool expanded = false;
  bool follow = false;
  bool json = false;
  bool strict = false;
  bool force = false;
};

void add_options(OptionSet& options, ApplyCommand& command) {
  options.add("record", command.record, "RECORD", "calibration record (JSON); not with --store",
              Need::required);
  options.add("readings", command.readings, "FILE",
              "raw readings (CSV), or a log of any format; - is stdin");
  options.add("more", command.more, "FILE",
              "records of the other sensors, if a log has several; the log is then the last file");
  options.add_output(
      command.output,
      "output file; - is stdout. FILE.npy contains only the results, for NumPy [default: -]");
  options.add_flag("--json", command.json, "rows as JSON, one object per line, instead of CSV");
  options.add("--field-magnitude", command.field_magnitude, "F",
              "magnitude of the field at the site of the readings [default: the record's]");
  options.add("--field-unit", command.field_unit, "UNIT",
              "unit of --field-magnitude and of the results [default: the record's]");
  options.add("--latitude", command.latitude, "DEG",
              "latitude of the site of the readings, to compute the gravity there");
  options.add("--longitude", command.longitude, "DEG",
              "longitude of the site of --latitude [default: 0]");
  options.add("--height", command.height, "M",
              "height of the site of --latitude above the ellipsoid [default: 0]");
  options.add("--gravity-model", command.gravity_model, "NAME", "gravity model [default: wgs84]");
  options.add("--attitude", command.attitude, "RECORD",
              "record of an accelerometer whose readings are in the same file; it is needed for "
              "headings and for records with two fields");
  options.add("--frame", command.frame, "assembly|sensor",
              "frame of the results, for an instrument that was calibrated in an assembly "
              "[default: assembly]");
  options.add("--body", command.body, "BODY",
              "file with the rotation of the sensor in a model, from `calibrate --method "
              "attitude`; the results are in the model's frame");
  options.add("--joint", command.joint, "RECORD=BODY",
              "record and rotation of a second instrument in the model, whose readings are in the "
              "same file; adds the column joint_deg, the angle between the two instruments");
  options.add("--alarm", command.alarm, "DEG",
              "with --joint: a row gets the flag 'moved' if its angle is larger than DEG and "
              "significant [default: 0]");
  options.add("--declination", command.declination, "DEG",
              "magnetic declination, added to headings [default: 0]");
  options.add("--yaw-above", command.yaw_above, "DEG",
              "pitch above which yaw is computed instead of roll [default: 85]");
  options.add("--pitch", command.pitch, "asin|atan2",
              "formula of pitch: asin(f_x / F), or atan2, which does not use F [default: asin]");
  options.add_flag("--uncertainty", command.uncertainty,
                   "add columns u_... with the standard uncertainty of each result");
  options.add_flag("--expanded", command.expanded,
                   "add columns U_... and k_... with the expanded uncertainty and its coverage "
                   "factor; implies --uncertainty");
  options.add("--level", command.level, "P", "coverage probability of --expanded [default: 0.95]");
  options.add("--field-magnitude-u", command.field_magnitude_u, "U",
              "standard uncertainty of the field's magnitude at the site of the readings, in the "
              "unit of the results [default: 0]");
  options.add("--noise", command.noise, "SD",
              "standard deviation of a reading, for --uncertainty [default: the scatter of the "
              "calibration]");
  options.add("--resolution", command.resolution, "Q",
              "smallest step of a reading, for --uncertainty [default: the record's]");
  options.add(
      "--temperature-u", command.temperature_u, "U",
      "standard uncertainty of the temperature output, for --uncertainty [default: the record's]");
  add_table_options(options, command.table);
  options.add("--decimals", command.decimals, "N",
              "number of decimals of all results, 0 to 15; fewer decimals are faster [default: as "
              "many as are needed to read back the same number]");
  add_stored_record_options(options, command.stored);
  options.add_flag("--follow", command.follow,
                   "write the result of each row as soon as the row is read");
  options.add_flag("--strict", command.strict,
                   "stop at the first row from which no result can be computed");
  options.add_flag("--force", command.force,
                   "use a refused record, or an impossible magnitude of the field");
}

// Returns the conversion of the field from the record's unit and site to the unit of the results
// and the site of the readings.
FieldConversion conversion_of(const ApplyCommand& command, const Calibration& calibration) {
  FieldAtReadings there;
  if (command.field_magnitude) {
    there.magnitude = parse_positive("--field-magnitude", *command.field_magnitude);
    const std::string unit = command.field_unit.value_or(calibration.sensor.field.unit);
    const FieldKind& kind = field_kind(calibration.sensor.field.kind);
    if (!command.force && !is_possible_magnitude(kind, *there.magnitude, unit)) {
      throw UsageError(formatted(
          "--field-magnitude: {} {} is not possible, because the field '{}' is {} on the Earth; "
          "give the unit of this number with --field-unit",
          *command.field_magnitude, unit, kind.name, possible_magnitudes(kind, unit)));
    }
  }
  if (command.field_magnitude_u) {
    there.magnitude_u = parse_nonnegative("--field-magnitude-u", *command.field_magnitude_u);
  }
  if ((command.longitude || command.height || command.gravity_model) && !command.latitude) {
    throw UsageError("--longitude, --height and --gravity-model require --latitude");
  }
  if (command.latitude) {
    if (!field_kind(calibration.sensor.field.kind).vertical) {
      throw UsageError("--latitude: this option computes gravity, but the field of the record is " +
                       calibration.sensor.field.kind);
    }
    const Site site = site_of_options(command.latitude, command.longitude, command.height, Site{});
    const GravityField gravity(site, command.gravity_model.value_or("wgs84"));
    there.gravity_m_s2 = gravity.magnitude();
    there.gravity_u_m_s2 = gravity.magnitude_uncertainty();
  }
  try {
    return field_conversion(calibration.sensor.field, command.field_unit.value_or(""), there);
  } catch (const DomainError& error) {
    throw UsageError("apply", error);
  }
}

ReductionOptions reduction_options(const ApplyCommand& command, const FieldConversion& conversion) {
  ReductionOptions options;
  options.factor = conversion.factor;
  options.magnitude = conversion.magnitude;
  if (command.declination) {
    options.declination_rad = number_of("--declination", *command.declination) * rad_per_deg;
  }
  if (command.yaw_above) {
    const double angle_deg = number_of("--yaw-above", *command.yaw_above);
    if (!(angle_deg > 0.0 && angle_deg <= 90.0)) {
      throw UsageError("--yaw-above: must be above 0 and up to 90 degrees");
    }
    options.inclination.yaw_above_rad = angle_deg * rad_per_deg;
  }
  if (command.pitch) {
    options.inclination.pitch_formula = pitch_formula_of("--pitch", *command.pitch);
  }
  return options;
}

Reducer make_reducer(const std::string& record,
                     const Calibration& calibration,
                     const ReductionOptions& options) {
  try {
    return Reducer(calibration, options, Force::yes);
  } catch (const DomainError& error) {
    throw DataError(record, error.what(), error.settings());
  }
}

// Rotates the calibration to the frame of the body in which the sensor is mounted, for example a
// wind-tunnel model.
// @param record  file name of the calibration.
// @param body    name of the file that states the rotation from the sensor to the model.
Calibration in_body(const std::string& record, const std::string& body, Calibration calibration) {
  const BodyRotation rotation = read_body_rotation(body);
  const std::string own = sha256_of_file(record);
  const bool same_record = !own.empty() && own == rotation.record_sha256;
  if (!same_record) {
    print_remark("note", formatted("the rotation in {} was not determined with the record {}; the "
                                   "uncertainties of both files are taken as independent",
                                   body, record));
  }
  try {
    return in_model_frame(std::move(calibration), rotation, same_record);
  } catch (const DomainError& error) {
    throw DataError(body, error.what(), error.settings());
  }
}

// Rotates the calibration to the frame of the results, which --frame or --body states.
Calibration in_wanted_frame(const ApplyCommand& command, Calibration calibration) {
  const std::string frame = command.frame.value_or("assembly");
  if (frame != "assembly" && frame != "sensor") {
    throw UsageError("--frame: must be 'assembly' or 'sensor', not '" + frame + "'");
  }
  if (command.body) {
    if (command.frame || command.attitude) {
      throw UsageError(
          "--body: cannot be combined with --frame or --attitude, because the results are in the "
          "model's frame");
    }
    return in_body(command.record, *command.body, std::move(calibration));
  }
  return frame == "sensor" ? calibration : in_assembly_frame(std::move(calibration));
}

// Returns the calibration in the record of --attitude, rotated to the frame of the results; nullopt
// without this option.
std::optional<Calibration> attitude_of(const ApplyCommand& command,
                                       const Calibration& calibration) {
  if (!command.attitude) {
    if (!calibration.sensor.also.empty()) {
      throw UsageError(
          formatted("the instrument also responds to the field {}: give --attitude RECORD, the "
                    "record of an instrument that measures this field and whose readings are in "
                    "the same file",
                    calibration.sensor.also.front().kind));
    }
    if (command.declination) {
      throw UsageError(
          "--declination: headings need --attitude RECORD, the record of an accelerometer");
    }
    return std::nullopt;
  }
  Calibration attitude = in_assembly_frame(read_unrefused(*command.attitude, command.force));
  if (command.frame.value_or("assembly") == "sensor") {
    // Rotates the second calibration to the sensor frame of the first instrument.
    attitude.sensor.rotation_sensor_from_assembly =
        calibration.sensor.rotation_sensor_from_assembly
            ? std::optional<Eigen::Matrix3d>(
                  calibration.sensor.rotation_sensor_from_assembly->transpose())
            : std::nullopt;
    attitude = in_assembly_frame(std::move(attitude));
  }
  const std::string wanted =
      calibration.sensor.also.empty() ? "gravity" : calibration.sensor.also.front().kind;
  if (attitude.sensor.field.kind != wanted || attitude.sensor.response.bias.size() < 3 ||
      !attitude.sensor.also.empty()) {
    throw DataError(*command.attitude,
                    "--attitude: must be the record of an instrument with three axes or more that "
                    "was calibrated against " +
                        wanted);
  }
  if (!calibration.sensor.also.empty()) {
    try {
      attitude = converted(
          attitude, field_conversion(attitude.sensor.field, calibration.sensor.also.front().unit));
    } catch (const DomainError& error) {
      throw DataError(*command.attitude, error.what(), error.settings());
    }
  }
  return attitude;
}

ReadingNoise reading_noise(const ApplyCommand& command, const Calibration& calibration) {
  ReadingNoise noise = stated_noise(calibration);
  if (command.noise) {
    noise.sd = Eigen::VectorXd::Constant(calibration.sensor.instrument.axis_count(),
                                         parse_nonnegative("--noise", *command.noise));
  }
  if (command.resolution) {
    noise.resolution = parse_nonnegative("--resolution", *command.resolution);
  }
  if (command.temperature_u) {
    noise.temperature_u = parse_nonnegative("--temperature-u", *command.temperature_u);
  }
  return noise;
}

double level_of(const ApplyCommand& command) {
  if (!command.level) {
    return 0.95;
  }
  const double level = number_of("--level", *command.level);
  if (!(level > 0.0 && level < 1.0)) {
    throw UsageError("--level: must be between 0 and 1");
  }
  return level;
}

void put_propagation(const std::string& record,
                     const Calibration& calibration,
                     const Reducer& reducer,
                     const ReadingNoise& noise,
                     double factor,
                     double level,
                     std::optional<ReadingPropagation>& propagation) {
  try {
    propagation.emplace(calibration, reducer, noise, factor, level);
  } catch (const DomainError& error) {
    throw DataError(record, error.what(), error.settings());
  }
}

// The second instrument in the same body (for example a wind-tunnel model), stated by --joint. The
// angle between this instrument and the first instrument is computed.
struct Joint {
  Joint(const ApplyCommand& command,
        const FieldConversion& conversion,
        const Calibration& own,
        const Reducer& own_reducer,
        const CsvReader& csv) {
    const std::size_t parting = command.joint->find('=');
    if (parting == std::string::npos || !command.body) {
      throw UsageError(
          "--joint: must be RECORD.json=BODY.json, and requires --body for the first instrument");
    }
    const std::string path = command.joint->substr(0, parting);
    calibration =
        in_body(path, command.joint->substr(parting + 1), read_unrefused(path, command.force));
    reducer.emplace(make_reducer(path, calibration, {}));
    columns.reducer = &*reducer;
    columns.columns = columns_in(csv, calibration);
    if (columns.columns.front().plus == columns_in(csv, own).front().plus) {
      throw UsageError(formatted(
          "--joint: both instruments use the column '{}'; rename the columns to SLOT.axis, with "
          "the slot from each record",
          columns.columns.front().plus));
    }
    if (command.alarm) {
      columns.alarm_rad = parse_nonnegative("--alarm", *command.alarm) * rad_per_deg;
    }
    try {
      uncertainty.emplace(calibration, *reducer, reading_noise(command, calibration));
      own_uncertainty.emplace(own, own_reducer, reading_noise(command, own), conversion.factor);
      columns.degrees_of_freedom = own.fit.statistics->degrees_of_freedom.sum() +
                                   calibration.fit.statistics->degrees_of_freedom.sum();
      columns.uncertainty = &*uncertainty;
      columns.own_uncertainty = &*own_uncertainty;
    } catch (const DomainError& error) {
      print_remark("note",
                   formatted("the uncertainty of joint_deg cannot be computed: {}", error.what()));
    }
  }

  Calibration calibration;
  std::optional<Reducer> reducer;
  std::optional<ReadingPropagation> uncertainty, own_uncertainty;
  JointColumns columns;
};

// Corrects the readings of a log with the records of several sensors.
int run_records(const ApplyCommand& command) {
  if (command.follow || command.uncertainty || command.expanded || command.attitude ||
      command.joint || command.body || command.json || command.output.ends_with(".npy")) {
    throw UsageError(
        "apply: with several RECORDs, the columns of a log are only corrected and written as CSV; "
        "for angles, uncertainties or other formats, apply each RECORD separately");
  }
  std::vector<std::string> records = {command.record, command.readings};
  records.insert(records.end(), command.more.begin(), command.more.end() - 1);
  apply_records(records, command.more.back(), command.table, command.output, command.force);
  return 0;
}

int run_one(const ApplyCommand& command) {
  const Calibration calibration =
      in_wanted_frame(command, read_unrefused(command.record, command.force));
  const FieldConversion conversion = conversion_of(command, calibration);
  const Reducer reducer =
      make_reducer(command.record, calibration, reduction_options(command, conversion));
  const std::optional<Calibration> attitude = attitude_of(command, calibration);
  const std::optional<Reducer> attitude_reducer =
      attitude ? std::optional<Reducer>(make_reducer(*command.attitude, *attitude, {}))
               : std::nullopt;
  OpenTable table;
  std::optional<InputFile> followed;
  if (command.follow &&
      command.table.temperature_column.value_or("").find(',') != std::string::npos) {
    throw UsageError(
        "--temperature-column: only one column can be named with --follow; temperatures of single "
        "axes are read from the columns AXIS_temperature");
  }
  if (command.follow) {  // rows are processed as they arrive, without reading ahead
    followed.emplace(command.readings);
    table.csv = std::make_unique<CsvReader>(
        [&](char* buffer, std::size_t size) { return followed->read(buffer, size); },
        command.readings, CsvReader::Quotes::end_with_line);
  } else {
    table = open_table(command.readings, command.table,
                       {.axes = calibration.sensor.instrument.axes,
                        .kind = calibration.sensor.instrument.differences.empty()
                                    ? calibration.sensor.instrument.kind
                                    : "",
                        .unit = calibration.sensor.instrument.unit,
                        .of_recording = calibration.sensor.instrument.kind});
  }
  CsvReader& csv = *table.csv;
  ReductionCsvOptions options;
  if (command.output.ends_with(".npy")) {
    options.form = ReductionForm::npy;
    if (command.follow || command.decimals || command.json) {
      throw UsageError("-o FILE.npy: cannot be combined with --follow, --decimals or --json");
    }
  }
  options.strict = command.strict;
  options.every_row = command.follow;
  if (command.decimals) {
    options.decimals = parse_whole_number("--decimals", *command.decimals, 0);
    constexpr int most = 15;
    if (*options.decimals > most) {
      throw UsageError("--decimals: must be 15 or less");
    }
  }
  if (attitude_reducer) {
    options.attitude = &*attitude_reducer;
    options.attitude_columns = columns_in(csv, *attitude);
  }
  options.temperature_column =
      command.follow ? command.table.temperature_column.value_or("temperature") : "temperature";
  std::optional<ReadingPropagation> uncertainty;
  std::optional<ReadingPropagation> attitude_uncertainty;
  if (command.uncertainty || command.expanded) {
    put_propagation(command.record, calibration, reducer, reading_noise(command, calibration),
                    conversion.factor, level_of(command), uncertainty);
    options.uncertainty = &*uncertainty;
    options.expanded = command.expanded;
    uncertainty->set_field_u(conversion);
    if (attitude_reducer) {
      put_propagation(*command.attitude, *attitude, *attitude_reducer, {}, 1.0, level_of(command),
                      attitude_uncertainty);
      options.attitude_uncertainty = &*attitude_uncertainty;
      if (!calibration.provenance.positioner.empty() &&
          calibration.provenance.positioner == attitude->provenance.positioner) {
        uncertainty->share_cube();
      }
    }
  } else if (command.noise || command.resolution || command.temperature_u ||
             command.field_magnitude_u || command.level) {
    throw UsageError(
        "--noise, --resolution, --temperature-u and --field-magnitude-u require --uncertainty; "
        "--level requires --expanded");
  }
  std::optional<Joint> joint;
  if (command.joint) {
    joint.emplace(command, conversion, calibration, reducer, csv);
    options.joint = joint->columns;
  } else if (command.alarm) {
    throw UsageError("--alarm: requires --joint");
  }
  // The output of --follow never ends, so a temporary file would never be renamed. The rows are
  // therefore written directly to the output file. Opening the output file empties it, so all
  // options are checked first.
  OutputFile output(command.output,
                    command.follow ? OutputFile::Mode::direct : OutputFile::Mode::replace_whole);
  const std::vector<ReadingColumn> columns = columns_in(csv, calibration);
  const auto header = [&](std::size_t rows) {
    return reduction_npy_header(columns, reducer, options, rows);
  };
  if (options.form == ReductionForm::npy) {
    output.write(header(0));
  }
  JsonLines json;
  const ReductionCsvSummary summary =
      reduce_csv(csv, columns, reducer, options, [&](std::string_view rows) {
        command.json ? output.write(json.of(rows)) : output.write(rows);
      });
  if (options.form == ReductionForm::npy) {
    output.rewrite_start(header(summary.rows));
  }
  output.commit();
  if (!gives_field(calibration)) {
    print_remark("note",
                 "the biases in the record include the field during the calibration. Each result "
                 "is therefore the reading minus the bias at the temperature of the reading; "
                 "residual and direction are not computed");
  }
  if (calibration.sensor.instrument.axis_count() == 2 && reducer.kind().has_axis_elevation) {
    print_remark("note", "with 2 axes, the third component is known only up to its sign");
  }
  const auto print_rows = [&](std::size_t rows, const std::string& fact) {
    if (rows > 0) {
      print_line(formatted("{}: {} of {} rows {}", command.readings, rows, summary.rows, fact));
    }
  };
  print_rows(summary.unreadable,
             formatted("gave no result (the first is line {}) and have the flag 'unreadable'",
                       summary.first_unreadable_line));
  const std::string& field = calibration.sensor.field.kind;
  if (field_kind(field).local && !field_kind(field).rotation &&
      2 * summary.far_from_field > summary.rows) {
    print_rows(
        summary.far_from_field,
        formatted("differ from the field's magnitude ({:g} {}) by more than 30 %; are the "
                  "readings in the record's unit, and is --field-magnitude in --field-unit?",
                  reducer.magnitude(), command.field_unit.value_or(calibration.sensor.field.unit)));
  }
  print_rows(summary.extrapolated,
             "are at temperatures outside the calibrated range and have the flag 'extrapolated'");
  print_rows(summary.moved, "have a joint angle larger than --alarm, and the flag 'moved'");
  print_rows(summary.saturated,
             "have a reading at or beyond the range of its axis and the flag 'saturated'");
  print_rows(summary.clamped, "have a component larger than the field and the flag 'clamped'");
  return 0;
}

int run(const ApplyCommand& given) {
  const std::unique_ptr<TemporaryFile> record = stored_record(given.stored);
  if (!record) {
    if (given.readings.empty()) {
      throw UsageError("apply: requires a RECORD and a FILE of readings");
    }
    return given.more.empty() ? run_one(given) : run_records(given);
  }
  if (!given.readings.empty()) {
    throw UsageError("--store: replaces RECORD; give only the FILE of readings");
  }
  ApplyCommand command = given;
  command.readings = given.record;
  command.record = record->path();
  return run_one(command);
}

}  // namespace

Subcommand apply_subcommand() {
  return make_subcommand<ApplyCommand>(
      "apply", "turn raw readings into field components and angles", "", &add_options, &run);
}

}  // namespace axiscal::cli
