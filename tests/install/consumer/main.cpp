// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/reduction.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/field/gravity_field.hpp>
#include <cstdio>

// Exits with 0 if the pitch [deg] equals the argument.
int main(int argc, char** argv) {
  axiscal::SensorModel truth;
  truth.instrument.kind = "accelerometer";
  truth.field.kind = "gravity";
  truth.field.unit = "g";
  truth.response.bias = Eigen::Vector3d::Zero();
  truth.response.sensitivity = Eigen::Matrix3d::Identity();
  axiscal::Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field = axiscal::GravityField();
  const axiscal::Calibration calibration = axiscal::calibrate(
      experiment,
      axiscal::simulate(truth, axiscal::make_run_sheet(axiscal::standard_design(12), 1, 1)));
  const axiscal::Reducer reducer(calibration);
  const std::array<double, 3> reading = {0.5, 0.0, 0.86602540378443865};
  const double pitch_deg = reducer(reading)["pitch_deg"];
  std::printf("gravity %.4f m/s^2, pitch %.4f degrees\n",
              axiscal::GravityField(axiscal::Site{45.0, 8.0, 0.0}).magnitude(), pitch_deg);
  return argc == 2 && std::abs(pitch_deg - std::atof(argv[1])) < 1e-9 ? 0 : 1;
}
