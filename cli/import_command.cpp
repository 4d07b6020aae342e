// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/exchange/import.hpp"
#include "subcommands.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct ImportCommand {
  std::string file;
  std::optional<std::string> format, instrument, instance, magnitude;
  std::string output = "-";
};

void add_options(OptionSet& options, ImportCommand& command) {
  options.add("file", command.file, "FILE", "their file; - is stdin", Need::required);
  options.add("--format", command.format, "NAME", "px4, ardupilot, kalibr or imucal");
  options.add("--instrument", command.instrument, "KIND",
              "accelerometer (default), gyroscope or magnetometer: which of its sensors");
  options.add("--instance", command.instance, "N", "number of the sensor, 0 to 9; 0");
  options.add("--magnitude", command.magnitude, "F",
              "of the field, in the format's unit; 9.80665 m/s^2, 1 rad/s, 0.5 G");
  options.add_output(command.output);
}

int run(const ImportCommand& command) {
  if (!command.format) {
    throw UsageError("import: needs --format px4, ardupilot, kalibr or imucal");
  }
  ImportOptions options;
  options.kind = command.instrument.value_or(options.kind);
  if (command.instance) {
    options.instance = whole_number_of("--instance", *command.instance, 0);
  }
  if (command.magnitude) {
    options.magnitude = positive_of("--magnitude", *command.magnitude);
  }
  const std::string text = read_whole_file(command.file);
  try {
    write_whole_file(command.output, calibration_json(import_calibration(
                                         text, command.file, *command.format, options)));
  } catch (const DomainError& error) {
    throw UsageError("import", error);
  }
  return 0;
}

}  // namespace

Subcommand import_subcommand() {
  return make_subcommand<ImportCommand>(
      "import", "calibration of other software -> calibration record", "", &add_options, &run);
}

}  // namespace axiscal::cli
