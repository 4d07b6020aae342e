// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>

#include "axiscal/calib/body.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "calibrate_command.hpp"
#include "core/formatted.hpp"
#include "input.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

std::vector<ReferenceReading> references_in(const CalibrateCommand& command,
                                            const std::string& path,
                                            const Calibration& calibration) {
  const OpenTable table = open_table(path, command.rests.log.table,
                                     {.axes = calibration.sensor.instrument.axes,
                                      .kind = calibration.sensor.instrument.differences.empty()
                                                  ? calibration.sensor.instrument.kind
                                                  : "",
                                      .unit = calibration.sensor.instrument.unit});
  return read_references(*table.csv, calibration);
}

std::string degrees(double rad) {
  return number_text(std::round(rad * deg_per_rad * 1e5) * 1e-5);
}

std::string text_of(const BodyRotation& body) {
  std::string text =
      formatted("rotation of the sensor in the model, from {} readings\n", body.readings);
  text += "\nModel from sensor\n";
  for (Eigen::Index i = 0; i < 3; ++i) {
    text += formatted("  {:>12.8f}{:>12.8f}{:>12.8f}\n", body.rotation_model_from_sensor(i, 0),
                      body.rotation_model_from_sensor(i, 1), body.rotation_model_from_sensor(i, 2));
  }
  text += "\nStandard uncertainty of the rotation about the model's axes [degrees]\n";
  for (Eigen::Index i = 0; i < 3; ++i) {
    text += formatted("  {}  {}\n", "xyz"[i], degrees(std::sqrt(body.covariance(i, i))));
  }
  text +=
      body.residual_sd_rad > 0.0
          ? formatted(
                "\nstandard deviation between the readings and the known attitudes: {} degrees\n",
                degrees(body.residual_sd_rad))
          : "";
  text += body.tare_rad > 0.0
              ? formatted(
                    "\nthe tare changed the rotation by {} degrees; the rotation about the "
                    "vertical is unchanged\n",
                    degrees(body.tare_rad))
              : "";
  return text;
}

}  // namespace

int run_attitude(const CalibrateCommand& command) {
  if (!command.experiment.from) {
    throw UsageError(
        "--method attitude: requires --from RECORD, the calibration of the instrument");
  }
  const bool finds = !command.experiment.files.empty();
  if ((finds && command.body) || (!finds && !command.tare) || command.experiment.files.size() > 1) {
    throw UsageError(
        "--method attitude: requires one FILE of readings in known attitudes, or --tare FILE; with "
        "--tare, give --body BODY if the rotation was determined before");
  }
  const std::string& record = *command.experiment.from;
  const Calibration calibration = read_unrefused(record, command.force);
  if (command.output) {
    forbid_replacing_input(*command.output);
  }
  BodyOptions options;
  if (command.experiment.direction_u) {
    options.reference_u_rad = parse_nonnegative("--direction-u", *command.experiment.direction_u);
  }
  BodyRotation body;
  try {
    if (finds) {
      body = find_body_rotation(
          calibration, references_in(command, command.experiment.files.front(), calibration),
          options);
    } else if (command.body) {
      body = read_body_rotation(*command.body);
    } else {
      print_remark(
          "note",
          "because there are no readings in known attitudes, the sensor's axes are assumed to be "
          "parallel to the model's axes, and the tare corrects two angles; the angle about the "
          "vertical stays uncorrected, with an assumed standard uncertainty of 1 degree");
    }
    options.same_record = finds || body.record_sha256 == sha256_of_file(record);
    if (command.tare) {
      body = corrected_by_tare(calibration, std::move(body),
                               references_in(command, *command.tare, calibration), options);
    }
  } catch (const SetupError&) {
    throw;
  } catch (const DomainError& error) {
    throw DataError(record, error.what(), error.settings());
  }
  body.record = record;
  body.record_sha256 = sha256_of_file(record);
  const std::string json = body_rotation_json(body);
  if (command.output) {
    write_whole_file(*command.output, json);
  }
  if (command.output != "-") {
    print_result_text(command.json ? json : text_of(body));
  }
  return 0;
}

}  // namespace axiscal::cli
