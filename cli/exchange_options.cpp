// SPDX-License-Identifier: Apache-2.0
#include "exchange_options.hpp"

#include "subcommands.hpp"

namespace axiscal::cli {
namespace {

void add_export_options(OptionSet& options, ExportCommand& command) {
  options.add("record", command.records, "RECORD",
              "calibration record (JSON); the format kalibr takes two records (accelerometer and "
              "gyroscope) or the output of `noise --json`; the formats px4, ardupilot and iio take "
              "the records of all sensors of a vehicle");
  options.add("--format", command.format, "NAME", "name of the format; --list prints the names");
  options.add_flag("--list", command.list,
                   "list the formats with the formulas that the other software uses");
  options.add_flag("--json", command.json,
                   "print JSON: with --list the formats; with -o FILE the format, the file, notes, "
                   "and the parts of the record that the file lacks");
  options.add("--reading-factor", command.reading_factor, "R",
              "factor from the readings to the driver's output in the other software, for example "
              "in m/s^2 per count");
  options.add("--gravity", command.gravity, "G",
              "local gravity [m/s^2], for a record in g that does not contain it");
  options.add(
      "--numbers", command.numbers, "TYPE",
      "number type of a C header: double, float, or fixed point such as q16 or q0:16 (binary "
      "places of the readings, then of the field)");
  options.add("--name", command.name, "ID",
              "prefix of the names in a C header [default: axiscal_KIND, or axiscal_KIND_SLOT]");
  options.add("--instance", command.instance, "N", "number of the sensor, 0 to 9 [default: 0]");
  options.add("--laboratory", command.laboratory, "FILE",
              "file with the details of a digital calibration certificate (format dcc): "
              "laboratory, customer, number, ... (see `report --laboratory`)");
  add_unit_options(options, command.units);
  add_stored_record_options(options, command.stored);
  options.add_flag("--lossy", command.lossy,
                   "write only the parts of the calibration that the format supports, and list the "
                   "lost parts");
  options.add_flag("--force", command.force,
                   "export the record even if its calibration was refused");
  options.add_output(command.output);
}

void add_import_options(OptionSet& options, ImportCommand& command) {
  options.add("file", command.file, "FILE", "file of the other software; - is stdin",
              Need::required);
  options.add("--format", command.format, "NAME", "px4, ardupilot, kalibr or imucal");
  options.add("--instrument", command.instrument, "KIND",
              "sensor to read: accelerometer, gyroscope or magnetometer [default: accelerometer]");
  options.add("--instance", command.instance, "N", "number of the sensor, 0 to 9 [default: 0]");
  options.add(
      "--magnitude", command.magnitude, "F",
      "magnitude of the field, in the format's unit [default: 9.80665 m/s^2, 1 rad/s, 0.5 G]");
  options.add_flag("--json", command.json, "also print the record, if -o FILE is given");
  options.add_output(command.output);
}

}  // namespace

Subcommand export_subcommand(int (*run)(const ExportCommand&)) {
  return make_subcommand<ExportCommand>("export", "write a calibration for other software", "",
                                        &add_export_options, run);
}

Subcommand import_subcommand(int (*run)(const ImportCommand&)) {
  return make_subcommand<ImportCommand>("import", "read a calibration of other software", "",
                                        &add_import_options, run);
}

}  // namespace axiscal::cli
