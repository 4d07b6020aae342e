// SPDX-License-Identifier: Apache-2.0
// Runs an experiment file, which states the instrument, the field, the method and the files with
// the readings. The folder examples/experiments contains such a file for each instrument, field and
// frame (see docs/experiments.md).
#include <axiscal/calib/calibrate_run.hpp>
#include <axiscal/calib/experiment_json.hpp>
#include <axiscal/calib/run.hpp>
#include <axiscal/calib/summary.hpp>
#include <axiscal/core/error.hpp>
#include <cstdio>

int main(int argc, char** argv) {
  try {
    const axiscal::ExperimentFile file =
        axiscal::read_experiment(argc > 1 ? argv[1] : "experiments/transfer.json");
    axiscal::Experiment experiment = file.experiment;
    const axiscal::Run run =
        axiscal::read_run(file.paths.observations.front(),
                          axiscal::observation_columns(experiment, axiscal::Units::one));
    if (!run.axes.empty()) {
      experiment.instrument.axes = run.axes;
    }
    for (const axiscal::Calibration& calibration : axiscal::calibrate_run(experiment, run)) {
      std::puts(axiscal::summary(calibration).c_str());
      for (const std::string& name : calibration.fit.statistics->parameter_names) {
        const axiscal::Quantity quantity = calibration.parameter(name);
        std::printf("%-20s %10.5f +- %.5f %s\n", name.c_str(), quantity.value, quantity.U,
                    quantity.unit.c_str());
      }
    }
  } catch (const axiscal::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
