// SPDX-License-Identifier: Apache-2.0
// Measures a new cube with three calibrated instruments. Then calibrates a fourth instrument in
// this cube twice: first with the nominal cube, then with the measured cube.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/characterize.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/calib/tolerance.hpp>
#include <axiscal/field/gravity_field.hpp>
#include <cmath>
#include <cstdio>

namespace {

axiscal::SensorModel instrument(double bias) {
  axiscal::SensorModel truth;
  truth.instrument.kind = "accelerometer";
  truth.field.kind = "gravity";
  truth.field.unit = "g";
  truth.response.bias = Eigen::Vector3d(bias, -bias, 0.5 * bias);
  truth.response.sensitivity = Eigen::Matrix3d::Identity();
  return truth;
}

// Simulates six replicates of the 12 design points, with a noise of 5e-6 g.
axiscal::Observations read_in(const axiscal::Positioner& cube,
                              const axiscal::SensorModel& truth,
                              const Eigen::Vector2d& slope,
                              std::uint64_t seed) {
  return axiscal::simulate(truth, axiscal::make_run_sheet(axiscal::standard_design(12), 6, seed),
                           {.noise_sd = 5e-6, .slope = slope, .positioner = cube, .seed = seed});
}

double error_of(const axiscal::Calibration& found, const axiscal::SensorModel& truth) {
  return std::hypot((found.sensor.response.bias - truth.response.bias).norm(),
                    (found.sensor.response.sensitivity - truth.response.sensitivity).norm());
}

}  // namespace

int main() {
  // The faces of the new cube deviate from right angles by 2 mrad (standard deviation). The cube of
  // the first calibrations is exact.
  axiscal::RandomStream workshop(4);
  const axiscal::CubeFeet drawing = axiscal::feet_of_frame({});
  const axiscal::Positioner made =
      axiscal::random_positioner(drawing, {}, {.squareness_rad = 2e-3}, workshop);

  axiscal::Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.field = axiscal::GravityField();
  std::vector<axiscal::Reference> references;
  for (const char* name : {"A", "B", "C"}) {
    const std::uint64_t seed = references.size() + 1;
    const axiscal::SensorModel truth = instrument(0.01 * static_cast<double>(seed));
    axiscal::Reference reference;
    reference.slot = name;
    reference.instrument = name;
    reference.calibration =
        axiscal::calibrate(experiment, read_in(axiscal::Positioner(), truth, {0.001, 0.0}, seed));
    reference.observations = read_in(made, truth, {0.004, -0.003}, 10 + seed);
    references.push_back(std::move(reference));
  }

  axiscal::CharacterizeOptions options;
  options.id = "cube-07";
  options.drawing = axiscal::Positioner(drawing);
  const axiscal::Characterization result = axiscal::characterize(references, options);
  std::printf(
      "uncertainty of the normals %.1f urad; agreement of the instruments: p = "
      "%.2f\n",
      1e6 * result.normal_u_rad, result.p_value);

  // The true frame of the fourth instrument is the frame of the drawing. The frame of the measured
  // cube is defined as the one in which the normals of the cube fit the drawing best. The rotation
  // between the two frames is part of the mount.
  const axiscal::SensorModel fourth = instrument(0.07);
  const axiscal::Observations readings = read_in(made, fourth, {-0.002, 0.001}, 99);
  const double nominal = error_of(axiscal::calibrate(experiment, readings), fourth);
  experiment.positioner = result.positioner;
  experiment.rotation_sensor_from_positioner =
      result.references.front().rotation_sensor_from_positioner;
  const double measured = error_of(axiscal::calibrate(experiment, readings), fourth);
  std::printf("error with the cube as drawn %.1e, with the measured cube %.1e\n", nominal,
              measured);
  std::printf(nominal > 20.0 * measured ? "the error with the measured cube is at least 20 times "
                                          "smaller\n"
                                        : "the error with the "
                                          "measured cube is NOT 20 "
                                          "times smaller\n");
  return 0;
}
