// SPDX-License-Identifier: Apache-2.0
// Calibrate from a file of observations, print the result and store the record.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/calibration_json.hpp>
#include <axiscal/calib/observations_csv.hpp>
#include <axiscal/core/input_file.hpp>
#include <cstdio>

int main(int argc, char** argv) {
  try {
    axiscal::InputFile file(argc > 1 ? argv[1] : "run.csv");
    axiscal::CsvReader csv([&](char* to, std::size_t size) { return file.read(to, size); },
                           file.path());
    axiscal::Experiment experiment;
    experiment.instrument.kind = "accelerometer";
    experiment.instrument.unit = "V";
    experiment.field.kind = "gravity";
    const axiscal::ObservationsTable table = axiscal::read_observations(csv, {});
    const axiscal::Calibration result = axiscal::calibrate(experiment, table.observations);

    for (Eigen::Index k = 0; k < 3; ++k) {
      std::printf("axis %s: bias %9.6f V, sensitivity %9.6f %9.6f %9.6f V/g, se %.1e V/g\n",
                  result.instrument.axes[static_cast<std::size_t>(k)].c_str(),
                  result.response.bias(k), result.response.sensitivity(k, 0),
                  result.response.sensitivity(k, 1), result.response.sensitivity(k, 2),
                  result.statistics->sensitivity_se(k, 0));
    }
    std::printf("slope of the table: %.2f, %.2f mrad (faces agree: p = %.2f)\n",
                1e3 * result.levelness->mean_x, 1e3 * result.levelness->mean_y,
                result.levelness->p_value);
    for (const axiscal::CalibrationWarning& warning : result.warnings) {
      std::printf("warning: %s\n", warning.message.c_str());
    }
    std::printf("the record has %zu bytes of JSON\n", axiscal::calibration_json(result).size());
  } catch (const axiscal::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
