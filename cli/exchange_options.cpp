// SPDX-License-Identifier: Apache-2.0
#include "exchange_options.hpp"

#include "subcommands.hpp"

namespace axiscal::cli {
namespace {

void add_export_options(OptionSet& options, ExportCommand& command) {
  options.add(
      "record", command.records, "RECORD",
      "calibration record (JSON); for kalibr accelerometer and gyroscope in one file, for px4, "
      "ardupilot, iio all sensors of a vehicle; or the JSON of noise for kalibr");
  options.add("--format", command.format, "NAME", "one of --list");
  options.add_flag("--list", command.list, "list the formats with the formulas of their readers");
  options.add_flag("--json", command.json, "with --list: as JSON");
  options.add("--reading-factor", command.reading_factor, "R",
              "output of the consumer's driver for 1 unit of the readings (m/s^2 per count)");
  options.add("--gravity", command.gravity, "G", "m/s^2 per g, for a record in g without it");
  options.add("--numbers", command.numbers, "TYPE",
              "of a header: double, float, q16, q0:16 (binary places of readings, of the field)");
  options.add("--name", command.name, "ID",
              "prefix of the names in a header; axiscal_KIND, or axiscal_KIND_SLOT");
  options.add("--instance", command.instance, "N", "number of the sensor, 0 to 9; 0");
  options.add("--laboratory", command.laboratory, "FILE",
              "of dcc: laboratory, customer, number, ... as report --laboratory");
  add_unit_options(options, command.units);
  options.add_flag("--lossy", command.lossy, "write what the format holds, and say what is lost");
  options.add_flag("--force", command.force, "take a refused record too");
  options.add_output(command.output);
}

void add_import_options(OptionSet& options, ImportCommand& command) {
  options.add("file", command.file, "FILE", "their file; - is stdin", Need::required);
  options.add("--format", command.format, "NAME", "px4, ardupilot, kalibr or imucal");
  options.add("--instrument", command.instrument, "KIND",
              "accelerometer (default), gyroscope or magnetometer: which of its sensors");
  options.add("--instance", command.instance, "N", "number of the sensor, 0 to 9; 0");
  options.add("--magnitude", command.magnitude, "F",
              "of the field, in the format's unit; 9.80665 m/s^2, 1 rad/s, 0.5 G");
  options.add_output(command.output);
}

}  // namespace

Subcommand export_subcommand(int (*run)(const ExportCommand&)) {
  return make_subcommand<ExportCommand>("export", "calibration record -> formats of other software",
                                        "", &add_export_options, run);
}

Subcommand import_subcommand(int (*run)(const ImportCommand&)) {
  return make_subcommand<ImportCommand>("import",
                                        "calibration of other software -> calibration record", "",
                                        &add_import_options, run);
}

}  // namespace axiscal::cli
