// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>

#include <nlohmann/json.hpp>

#include "adjuster_options.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/history.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "axiscal/report/calibration_report.hpp"
#include "axiscal/report/certificate.hpp"
#include "core/formatted.hpp"
#include "core/temporary_file.hpp"
#include "input.hpp"
#include "report_options.hpp"
#include "sample_rests.hpp"
#include "store_client.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

// Returns true if a file is the log from which an IMU record was made. Records of version 0.1 do
// not mark the log among their input files.
bool is_own_log(const Calibration& calibration, const std::string& path) {
  const bool of_imu = calibration.fit.residuals.empty() || !calibration.fit.residuals.front().point;
  const auto may_be_log = [&](const InputFileDigest& input) {
    return input.is_log ||
           (of_imu && calibration.provenance.slot == calibration.sensor.instrument.kind);
  };
  const std::vector<InputFileDigest>& inputs = calibration.provenance.inputs;
  if (std::none_of(inputs.begin(), inputs.end(), may_be_log)) {
    return false;  // no input can be the log, so the checksum of the file is not needed
  }
  const std::string sha256 = sha256_of_file(path);
  return std::any_of(inputs.begin(), inputs.end(), [&](const InputFileDigest& input) {
    return input.sha256 == sha256 && may_be_log(input);
  });
}

// Reads a file with readings of the record's instrument. Prints a note if the record was made from
// another file.
// @return nullopt if the file is the log of an IMU record, which has no separate readings.
std::optional<Observations> readings_for(const Calibration& calibration,
                                         const std::string& path,
                                         const TableOptions& table) {
  if (path != "-" && is_own_log(calibration, path)) {
    print_remark("note", path +
                             " is the log from which the record was made; the report shows the "
                             "residuals of its rests");
    return std::nullopt;
  }
  ObservationsFile file =
      read_observations_file(path,
                             {.axes = calibration.sensor.instrument.axes,
                              .differences = calibration.sensor.instrument.differences,
                              .range = calibration.sensor.instrument.range},
                             {},
                             {.options = table,
                              .kind = calibration.sensor.instrument.differences.empty()
                                          ? calibration.sensor.instrument.kind
                                          : "",
                              .unit = calibration.sensor.instrument.unit,
                              .faces_of = calibration.sensor.instrument.kind});
  const bool is_input =
      std::any_of(calibration.provenance.inputs.begin(), calibration.provenance.inputs.end(),
                  [&](const InputFileDigest& input) {
                    return input.sha256.empty() || input.sha256 == file.run.inputs.front().sha256;
                  });
  if (!is_input) {
    print_remark("note", path +
                             " is not a file from which the record was made (the record contains "
                             "other SHA-256 digests); the readings are assigned to those of the "
                             "record by run number");
  }
  if (file.run.observations.readings.size() > calibration.fit.residuals.size()) {
    static_cast<void>(gather_rests(calibration.sensor.instrument.kind, file.run));
  }
  Observations observations = file.run.observations;
  const Eigen::Index m = calibration.sensor.instrument.axis_count();
  const std::vector<std::string>& slots = file.run.slots;
  const auto slot = std::find(slots.begin(), slots.end(), calibration.provenance.slot);
  if (slots.size() > 1 && slot != slots.end()) {
    observations.response = observations.response.middleCols(m * (slot - slots.begin()), m).eval();
  }
  if (observations.response.cols() != m) {
    throw DataError(path,
                    formatted("the readings in this file are of the slots {}, but the record is of "
                              "another slot",
                              joined(slots)));
  }
  return observations;
}

// Writes the certificate. @return the names of missing details that ISO/IEC 17025 requires.
std::vector<std::string> write_certificate(const ReportCommand& command,
                                           const Calibration& calibration) {
  CertificateDetails details;
  if (command.laboratory) {
    details = read_certificate_details(*command.laboratory);
  }
  write_whole_file(command.output, certificate_pdf(calibration, details));
  std::vector<std::string> missing = missing_details(calibration, details);
  if (!missing.empty()) {
    print_remark("note",
                 "the file of --laboratory lacks details that ISO/IEC 17025 "
                 "requires: " +
                     joined(missing));
  }
  return missing;
}

// Returns the output of --json: {"file", "kind", "serial", "missing"}.
std::string report_json(const ReportCommand& command,
                        const Calibration& calibration,
                        std::string_view kind,
                        const std::vector<std::string>& missing) {
  return nlohmann::ordered_json{{"file", command.output},
                                {"kind", kind},
                                {"serial", calibration.sensor.instrument.serial},
                                {"missing", missing}}
             .dump(2) +
         "\n";
}

}  // namespace

int run_report(const ReportCommand& given) {
  if (given.fleet) {
    return run_fleet(given);
  }
  ReportCommand command = given;
  const std::unique_ptr<TemporaryFile> record = stored_record(command.stored);
  if (record) {
    if (command.observations) {
      throw UsageError("--store: replaces RECORD; give at most the file of its readings");
    }
    if (!command.record.empty()) {
      command.observations = command.record;
    }
    command.record = record->path();
  }
  if (command.record.empty()) {
    throw UsageError("report: requires a RECORD, --store STORE or --fleet STORE");
  }
  for (const auto& [name, value] : {std::pair("--kind", command.kind),
                                    {"--model", command.model},
                                    {"--since", command.since},
                                    {"--until", command.until},
                                    {"--limits", command.limits}}) {
    if (value) {
      throw UsageError(formatted("{}: requires --fleet", name));
    }
  }
  if (command.output != "-" && !command.output.ends_with(".pdf") &&
      !command.output.ends_with(".html") && !command.output.ends_with(".htm") &&
      !command.output.starts_with("/dev/")) {
    throw UsageError(formatted("report: -o must end in .html or .pdf, not '{}'", command.output));
  }
  const Calibration calibration = read_calibration(command.record);
  if (command.json && command.output == "-") {
    throw UsageError("report: --json requires -o FILE, because the report itself goes to stdout");
  }
  if (command.output.ends_with(".pdf")) {
    const std::vector<std::string> missing = write_certificate(command, calibration);
    if (command.json) {
      write_whole_file("-", report_json(command, calibration, "certificate", missing));
    }
    return 0;
  }
  if (command.laboratory) {
    throw UsageError("report: --laboratory requires a certificate (-o FILE.pdf)");
  }
  ReportOptions options;
  std::optional<Observations> observations;
  if (command.observations) {
    observations = readings_for(calibration, *command.observations, command.table);
    options.observations = observations ? &*observations : nullptr;
  }
  if (command.history) {
    options.history = read_history(named_records(*command.history));
    if (std::none_of(options.history.begin(), options.history.end(), [&](const UnitHistory& unit) {
          return unit.serial == calibration.sensor.instrument.serial;
        })) {
      print_remark("note", formatted("{} contains no record of unit '{}'", *command.history,
                                     calibration.sensor.instrument.serial));
    }
  }
  if (command.positioner || command.adjusters || command.thread_pitch) {
    Surface table;
    if (command.positioner) {
      table = read_positioner(*command.positioner).surface();
    }
    set_adjusters(command.adjusters, command.thread_pitch, table);
    options.table = table;
  }
  std::optional<LogNoise> noise;
  if (command.noise) {
    noise = parse_noise(read_whole_file(*command.noise), *command.noise);
    options.noise = &*noise;
  }
  write_whole_file(command.output, calibration_report(calibration, options));
  if (command.json) {
    write_whole_file("-", report_json(command, calibration, "report", {}));
  }
  return 0;
}

}  // namespace axiscal::cli
