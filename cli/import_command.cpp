// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/exchange/import.hpp"
#include "exchange_options.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {

int run_import(const ImportCommand& command) {
  if (!command.format) {
    throw UsageError("import: requires --format px4, ardupilot, kalibr or imucal");
  }
  ImportOptions options;
  options.kind = command.instrument.value_or(options.kind);
  if (command.instance) {
    options.instance = parse_whole_number("--instance", *command.instance, 0);
  }
  if (command.magnitude) {
    options.magnitude = parse_positive("--magnitude", *command.magnitude);
  }
  const std::string text = read_whole_file(command.file);
  try {
    const std::string record =
        calibration_json(import_calibration(text, command.file, *command.format, options));
    write_whole_file(command.output, record);
    if (command.json && command.output != "-") {
      write_whole_file("-", record);
    }
  } catch (const DomainError& error) {
    throw UsageError("import", error);
  }
  return 0;
}

}  // namespace axiscal::cli
