// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "axiscal/core/input_file.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/exchange/export.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "core/formatted.hpp"
#include "core/redirected_streams.hpp"
#include "core/temporary_file.hpp"
#include "exchange_options.hpp"
#include "input.hpp"
#include "log_input.hpp"
#include "store_client.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

std::string formats_json() {
  nlohmann::ordered_json formats = nlohmann::ordered_json::array();
  for (const ExportFormat& format : export_formats()) {
    formats.push_back({{"name", format.name},
                       {"description", format.description},
                       {"formula", format.formula},
                       {"text", format.is_text}});
  }
  return formats.dump(2) + "\n";
}

// Returns the output of --json with -o FILE: an object {"format", "file", "notes", "lost"}.
std::string export_json(const ExportCommand& command, const Exported& result) {
  nlohmann::ordered_json json{
      {"format", *command.format}, {"file", command.output}, {"notes", result.notes}};
  json["lost"] = result.loss ? nlohmann::ordered_json(loss_text(*result.loss)) : nullptr;
  return json.dump(2) + "\n";
}

std::string list_of_formats() {
  std::string text;
  for (const ExportFormat& format : export_formats()) {
    text += formatted("{:<12}{}\n{:<12}{}\n", format.name, format.description, "", format.formula);
  }
  return text;
}

ExportOptions options_of(const ExportCommand& command) {
  ExportOptions options{.lossy = command.lossy};
  if (command.reading_factor) {
    options.reading_factor = number_of("--reading-factor", *command.reading_factor);
  }
  if (command.gravity) {
    options.local_gravity = parse_positive("--gravity", *command.gravity);
  }
  if (command.instance) {
    options.instance = parse_whole_number("--instance", *command.instance, 0);
  }
  if (command.laboratory) {
    options.laboratory = read_certificate_details(*command.laboratory);
  }
  options.name = command.name.value_or("");
  if (command.numbers) {
    options.numbers = parse_header_numbers(*command.numbers);
  }
  return options;
}

// Sets the unit of the readings from the options, if the record does not state one.
void state_unit(const UnitOptions& units, const std::string& path, Instrument& instrument) {
  const std::optional<std::string>& of_kind =
      instrument.kind == "accelerometer" || instrument.kind == "inclinometer" ? units.accelerometer
      : instrument.kind == "gyroscope"                                        ? units.gyroscope
      : instrument.kind == "magnetometer"                                     ? units.magnetometer
                                                                              : units.all;
  const std::optional<std::string>& unit = of_kind ? of_kind : units.all;
  if (!unit) {
    return;
  }
  if (!instrument.unit.empty() && instrument.unit != "1" && instrument.unit != *unit) {
    throw UsageError(
        formatted("export: the readings of the record {} are in {}, but the options give the unit "
                  "{}",
                  path, instrument.unit, *unit));
  }
  instrument.unit = *unit;
}

Exported exported(const ExportCommand& command) {
  const std::string& format = *command.format;
  try {
    ExportOptions options = options_of(command);
    std::vector<Calibration> records;
    for (const std::string& record : command.records) {
      records.push_back(read_unrefused(record, command.force));
      state_unit(command.units, record, records.back().sensor.instrument);
    }
    if (records.size() == 1) {
      if (format == "label" && can_be_read_again(command.records.front())) {
        options.digest = record_digest(in_one_line(read_whole_file(command.records.front())));
      }
      return export_calibration(records.front(), format, options);
    }
    if (records.size() == 2) {
      return export_imu(records.front(), records.back(), format, options);
    }
    std::vector<const Calibration*> all;
    for (const Calibration& record : records) {
      all.push_back(&record);
    }
    return export_vehicle(all, format, options);
  } catch (const DomainError& error) {
    throw UsageError("export", error);
  }
}

bool is_text(std::string_view name) {
  for (const ExportFormat& format : export_formats()) {
    if (format.name == name) {
      return format.is_text;
    }
  }
  return true;
}

// Exports a file that `noise --json` wrote, for Kalibr.
// @return false if the file is not of that format.
bool export_noise(const ExportCommand& command) {
  if (command.records.size() != 1 || command.format != "kalibr") {
    return false;
  }
  const std::string text = read_whole_file(command.records.front());
  if (text.find("\"axiscal-noise\"") == std::string::npos) {
    return false;
  }
  write_whole_file(command.output, kalibr_imu_yaml(parse_noise(text, command.records.front())));
  return true;
}

}  // namespace

int run_export(const ExportCommand& given) {
  ExportCommand command = given;
  const std::unique_ptr<TemporaryFile> record = stored_record(command.stored);
  if (record) {
    command.records.insert(command.records.begin(), record->path());
  }
  if (export_noise(command)) {
    return 0;
  }
  if (command.list) {
    write_whole_file(command.output, command.json ? formats_json() : list_of_formats());
    return 0;
  }
  if (command.records.empty() || !command.format) {
    throw UsageError(
        "export: requires --format NAME and a RECORD (format kalibr: the records of an "
        "accelerometer and of a gyroscope; formats px4, ardupilot and iio: the records of all "
        "sensors of a vehicle); --list prints the formats");
  }
  if (command.output == "-" && !is_text(*command.format) && isatty(STDOUT_FILENO) != 0) {
    throw UsageError(formatted("export: {} is a binary format; give -o FILE", *command.format));
  }
  if (command.json && command.output == "-") {
    throw UsageError("export: --json requires -o FILE, because the export itself goes to stdout");
  }
  const Exported result = exported(command);
  write_whole_file(command.output, result.content);
  if (command.json) {
    write_whole_file("-", export_json(command, result));
  }
  for (const std::string& note : result.notes) {
    print_remark("note", note);
  }
  if (result.loss) {
    print_error(formatted("axiscal: lost in the export: {}\n", loss_text(*result.loss)));
  }
  return 0;
}

}  // namespace axiscal::cli
