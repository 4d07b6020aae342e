// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "calibrate_command.hpp"
#include "column_advice.hpp"
#include "input.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

std::string rests_text(const ImuCalibration& imu) {
  const Segmentation& rests = imu.rests;
  std::string text =
      formatted("{} rests in {:.1f} s at {:.5g} Hz, threshold of the joined variance {:.4g}\n",
                rests.intervals.size(), static_cast<double>(rests.samples) / rests.rate_hz,
                rests.rate_hz, rests.threshold);
  if (imu.turns) {
    text += formatted("{} turns, attitude error {:.3g} degrees a component\n",
                      imu.turns->residuals.size(), imu.turns->residual_sd_rad * deg_per_rad);
  }
  return text;
}

ImuOptions options_of(const CalibrateCommand& command) {
  ImuOptions options = imu_options_of(command.rests, {"ax", "ay", "az"});
  ExperimentOptions experiment = command.experiment;
  if (experiment.instrument && *experiment.instrument != "accelerometer") {
    throw UsageError(
        "--instrument: with --imu it is the accelerometer, gyroscope and magnetometer");
  }
  experiment.instrument = "accelerometer";
  experiment.field = experiment.field.value_or("gravity");
  if (experiment.axes) {
    throw UsageError("--axes: with --imu the columns are --accelerometer X,Y,Z and the like");
  }
  options.experiment = make_experiment(experiment);
  if (options.experiment.instrument.range) {
    options.segment.range = options.experiment.instrument.range;
  }
  options.gyroscope_unit = command.gyroscope_unit.value_or("1");
  options.magnetometer_unit = command.magnetometer_unit.value_or("1");
  options.turns.fit_bias = command.fit_gyroscope_bias;
  if (options.experiment.field.has_longitude) {  // gravity does without
    options.magnetic_field.site = options.experiment.field.site;
  }
  options.magnetic_field.date = options.experiment.field.date;
  if (command.magnetic_magnitude) {
    options.magnetic_field.magnitude =
        positive_of("--magnetic-magnitude", *command.magnetic_magnitude);
  }
  if (command.cube && command.rests.plan) {
    throw UsageError("--cube: goes without --plan, which states the seats");
  }
  if (command.cube) {
    options.seats = Seats::recognised;
  }
  return options;
}

// The instrument of which the log lacks a column: the option that names its columns, and what such
// columns have in their names.
struct LackingInstrument {
  std::string_view option = "--accelerometer";
  std::string_view word = "acc";
};

LackingInstrument lacking_instrument(const RecordedLog& log, const ImuOptions& options) {
  const auto lacks = [&](const std::vector<std::string>& columns) {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const std::string& name) { return !find_column(log.columns, name); });
  };
  return lacks(options.accelerometer)  ? LackingInstrument{}
         : lacks(options.gyroscope)    ? LackingInstrument{"--gyroscope", "gyr"}
         : lacks(options.magnetometer) ? LackingInstrument{"--magnetometer", "mag"}
                                       : LackingInstrument{};
}

}  // namespace

int run_imu(const CalibrateCommand& command) {
  if (command.align || command.limits || command.table || command.history ||
      command.accept_suggestion) {
    throw UsageError(
        "--imu: goes without --align (the three are aligned), --limits, --table, --history and "
        "--accept-suggestion; check the records afterwards");
  }
  ImuOptions options = options_of(command);
  const RecordedLog log = record_log(*command.imu, command.rests.log);
  const auto take_if_there = [&](const std::optional<std::string>& option,
                                 const std::vector<std::string>& usual,
                                 std::vector<std::string>& columns) {
    if (!option && std::all_of(usual.begin(), usual.end(), [&](const std::string& name) {
          return find_column(log.columns, name).has_value();
        })) {
      columns = usual;
    }
  };
  take_if_there(command.rests.gyroscope, {"gx", "gy", "gz"}, options.gyroscope);
  take_if_there(command.rests.magnetometer, {"mx", "my", "mz"}, options.magnetometer);
  const std::size_t instruments =
      1 + (options.gyroscope.empty() ? 0U : 1U) + (options.magnetometer.empty() ? 0U : 1U);
  if (command.output && *command.output != "-" && instruments > 1 &&
      command.output->find("{slot}") == std::string::npos) {
    throw UsageError(
        formatted("-o: the log gives {} records; the file's name must hold {{slot}}", instruments));
  }
  const LackingInstrument lacking = lacking_instrument(log, options);
  ImuCalibration imu =
      advising_columns(lacking.option, lacking.word, [&] { return calibrate_imu(log, options); });
  std::vector<Calibration> records = imu.records();
  const InputFileDigest digest{
      .path = *command.imu, .sha256 = sha256_of_file(*command.imu), .is_log = true};
  for (Calibration& record : records) {
    record.inputs = {digest};
    record.notes.insert(record.notes.end(), imu.notes.begin(), imu.notes.end());
  }
  return deliver_records(command, records, rests_text(imu) + "\n");
}

}  // namespace axiscal::cli
