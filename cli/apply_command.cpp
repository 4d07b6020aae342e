// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/core/output_file.hpp"
#include "commands.hpp"
#include "input.hpp"

namespace axiscal::cli {
namespace {

ReductionOptions reduction_options(const ApplyCommand& command, const Calibration& calibration) {
  ReductionOptions options;
  if (command.field_magnitude) {
    options.magnitude = number_of("--field-magnitude", *command.field_magnitude);
    if (!(*options.magnitude > 0.0)) {
      throw UsageError("--field-magnitude: must be positive");
    }
  }
  if (command.field_unit && *command.field_unit != calibration.field.unit) {
    throw UsageError("--field-unit: the record is in '" + calibration.field.unit +
                     "', and this version does not convert '" + *command.field_unit + "' to it");
  }
  if (command.yaw_above) {
    const double angle_deg = number_of("--yaw-above", *command.yaw_above);
    if (!(angle_deg > 0.0 && angle_deg <= 90.0)) {
      throw UsageError("--yaw-above: must be above 0 and up to 90 degrees");
    }
    options.inclination.yaw_above_rad = angle_deg * rad_per_deg;
  }
  if (command.pitch) {
    if (*command.pitch != "asin" && *command.pitch != "atan2") {
      throw UsageError("--pitch: must be asin or atan2, not '" + *command.pitch + "'");
    }
    options.inclination.pitch_formula =
        *command.pitch == "atan2" ? PitchFormula::arctangent : PitchFormula::arcsine;
  }
  return options;
}

Reducer make_reducer(const ApplyCommand& command, const Calibration& calibration) {
  const ReductionOptions options = reduction_options(command, calibration);
  try {
    return Reducer(calibration, options);
  } catch (const DomainError& error) {
    throw DataError(command.record, error.what());
  }
}

// The columns of the record's axes: their names, or SLOT.axis in a log of its whole assembly.
std::vector<std::string> reading_columns(const Calibration& calibration, const CsvReader& csv) {
  std::vector<std::string> columns = calibration.instrument.axes;
  if (!calibration.slot.empty() && !csv.column(columns.front())) {
    for (std::string& column : columns) {
      column.insert(0, calibration.slot + ".");
    }
  }
  return columns;
}

}  // namespace

int run(const ApplyCommand& command) {
  forbid_overwriting(command.output, command.record);
  if (command.follow) {
    forbid_overwriting(command.output, command.readings);  // it would read what it writes
  }
  const Calibration calibration = read_calibration(command.record);
  if (calibration.status == "refused" && !command.force) {
    throw RefusedError(command.record +
                       ": this calibration was refused; look at its warnings, or use --force");
  }
  const Reducer reducer = make_reducer(command, calibration);
  InputFile input(command.readings);
  CsvReader csv = csv_reader_of(
      input, command.follow ? CsvReader::Quotes::end_with_line : CsvReader::Quotes::span_lines);
  // Output that goes on for ever is written to directly: it would never be put into its place.
  OutputFile output(command.output,
                    command.follow ? OutputFile::Mode::direct : OutputFile::Mode::replace_whole);
  const ReductionCsvSummary summary =
      reduce_csv(csv, reading_columns(calibration, csv), reducer,
                 {.strict = command.strict, .every_row = command.follow},
                 [&output](std::string_view text) { output.write(text); });
  output.commit();
  if (calibration.instrument.axis_count() == 2 && reducer.kind().has_axis_elevation) {
    std::fprintf(stderr, "note: with 2 axes the third component is known only up to its sign\n");
  }
  if (summary.unreadable > 0) {
    std::fprintf(stderr,
                 "%s: %zu of %zu rows could not be reduced (first: line %zu); flag "
                 "'unreadable'\n",
                 command.readings.c_str(), summary.unreadable, summary.rows,
                 summary.first_unreadable_line);
  }
  if (summary.clamped > 0) {
    std::fprintf(stderr,
                 "%s: %zu of %zu rows have a component larger than the field; flag "
                 "'clamped'\n",
                 command.readings.c_str(), summary.clamped, summary.rows);
  }
  return 0;
}

}  // namespace axiscal::cli
