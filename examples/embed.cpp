// SPDX-License-Identifier: Apache-2.0
// Uses the library in a program. The readings come from memory. An error message states what to do.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/calib/uncertainty.hpp>
#include <axiscal/field/gravity_field.hpp>
#include <cstdio>

int main() {
  axiscal::Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.instrument.unit = "counts";
  experiment.field = axiscal::GravityField();

  // Readings from a driver [counts], one row per orientation of the cube.
  Eigen::MatrixXd response(4, 3);
  response << -8190.0, 12.0, -30.0,  //
      8194.0, 15.0, -28.0,           //
      3.0, -8188.0, -33.0,           //
      5.0, 8200.0, -25.0;
  const axiscal::DesignPoint points[] = {{axiscal::Face::plus_x, axiscal::Face::plus_y},
                                         {axiscal::Face::minus_x, axiscal::Face::plus_y},
                                         {axiscal::Face::plus_y, axiscal::Face::plus_z},
                                         {axiscal::Face::minus_y, axiscal::Face::plus_z}};
  try {
    static_cast<void>(axiscal::calibrate(experiment, points, response));
  } catch (const axiscal::RefusedError& error) {
    std::printf("refused: %s\n", error.what());
  }

  // Readings at all 12 design points suffice; here they are simulated.
  axiscal::SensorModel truth;
  truth.instrument = experiment.instrument;
  truth.field.kind = "gravity";
  truth.field.unit = "g";
  truth.response.bias = Eigen::Vector3d(4.0, 10.0, -29.0);
  truth.response.sensitivity = 8192.0 * Eigen::Matrix3d::Identity();
  axiscal::SimulationOptions options;
  options.noise_sd = 2.0;
  const axiscal::Calibration result = axiscal::calibrate(
      experiment, axiscal::simulate(
                      truth, axiscal::make_run_sheet(axiscal::standard_design(12), 2, 1), options));
  for (const axiscal::ParameterUncertainty& one : axiscal::parameter_uncertainties(result)) {
    if (one.name == "z.bias" || one.name == "z.sensitivity.z") {
      std::printf("%s: %.1f +- %.1f %s (95 %%)\n", one.name.c_str(), one.value,
                  one.uncertainty.expanded, axiscal::parameter_unit(result, one.name).c_str());
    }
  }
  return 0;
}
