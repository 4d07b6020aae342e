// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/history.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/report/calibration_report.hpp"
#include "axiscal/report/certificate.hpp"
#include "commands.hpp"
#include "input.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

// The readings of the record's instrument; a remark where they are not those that it was made from.
Observations readings_for(const Calibration& calibration, const std::string& path) {
  const ObservationsFile file =
      read_observations_file(path, {.axes = calibration.instrument.axes,
                                    .differences = calibration.instrument.differences,
                                    .range = calibration.instrument.range});
  const bool is_input = std::any_of(calibration.inputs.begin(), calibration.inputs.end(),
                                    [&](const InputFileDigest& input) {
                                      return input.sha256.empty() || input.sha256 == file.sha256;
                                    });
  if (!is_input && !calibration.inputs.empty()) {
    print_remark("note", path +
                             " is not a file that the record was made from (its SHA-256 "
                             "differs): readings are matched by their run");
  }
  if (file.table.observations.response.cols() != calibration.instrument.axis_count()) {
    throw DataError(path, "it holds several slots; give the readings of this instrument");
  }
  return file.table.observations;
}

int write_certificate(const ReportCommand& command, const Calibration& calibration) {
  CertificateDetails details;
  if (command.laboratory) {
    forbid_overwriting(command.output, *command.laboratory);
    details = read_certificate_details(*command.laboratory);
  }
  write_whole_file(command.output, certificate_pdf(calibration, details));
  const std::vector<std::string> missing = missing_details(calibration, details);
  if (!missing.empty()) {
    print_remark("note", "ISO/IEC 17025 asks for more than --laboratory says: " + joined(missing));
  }
  return 0;
}

}  // namespace

int run(const ReportCommand& command) {
  forbid_overwriting(command.output, command.record);
  const Calibration calibration = read_calibration(command.record);
  if (command.output.ends_with(".pdf")) {
    return write_certificate(command, calibration);
  }
  ReportOptions options;
  std::optional<Observations> observations;
  if (command.observations) {
    forbid_overwriting(command.output, *command.observations);
    observations = readings_for(calibration, *command.observations);
    options.observations = &*observations;
  }
  if (command.history) {
    options.history = read_history(*command.history);
  }
  std::optional<LogNoise> noise;
  if (command.noise) {
    noise = parse_noise(read_whole_file(*command.noise), *command.noise);
    options.noise = &*noise;
  }
  write_whole_file(command.output, calibration_report(calibration, options));
  return 0;
}

}  // namespace axiscal::cli
