// SPDX-License-Identifier: Apache-2.0
// The program of the README.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/reduction.hpp>
#include <axiscal/calib/simulate.hpp>
#include <cstdio>

int main() {
  axiscal::Calibration truth;  // an ideal instrument, to have something to read
  truth.instrument.kind = "accelerometer";
  truth.response = {Eigen::Vector3d(0.1, -0.2, 0.3), 2.5 * Eigen::Matrix3d::Identity()};
  const axiscal::Observations readings =
      axiscal::simulate(truth, axiscal::make_run_sheet(axiscal::standard_design(12), 1, 1));

  axiscal::Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.field.kind = "gravity";
  const axiscal::Calibration calibration = axiscal::calibrate(experiment, readings);
  const axiscal::Reducer reducer(calibration);
  const double volts[] = {0.1 + 2.5 * 0.3420201433, -0.2, 0.3 + 2.5 * 0.9396926208};
  std::printf("pitch %.2f degrees\n", reducer.reduce(volts).derived.values[0]);
}
