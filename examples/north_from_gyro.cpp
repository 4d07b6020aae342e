// SPDX-License-Identifier: Apache-2.0
// Finds the direction of north from the Earth's rotation, with a simulated navigation-grade
// gyroscope.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/core/rotation.hpp>
#include <axiscal/core/units.hpp>
#include <axiscal/field/earth_rotation_field.hpp>
#include <cstdio>

int main() {
  const axiscal::Site site{.latitude_deg = 48.14};
  const axiscal::EarthRotationField earth(site, "deg/h");
  axiscal::SensorModel truth;
  truth.instrument = {.kind = "gyroscope", .unit = "deg/h"};
  truth.field.unit = "deg/h";
  truth.field.in_table =
      axiscal::rotation_table_from_enu(73.5 * axiscal::rad_per_deg) * earth.value_in_enu();
  truth.response.bias = Eigen::Vector3d(0.4, -0.2, 0.1);
  truth.response.sensitivity =
      (Eigen::Matrix3d() << 1.0002, 3e-4, -2e-4, 1e-4, 0.9998, 2e-4, 0.0, -3e-4, 1.0001).finished();
  // A measurement of ten minutes with an angular random walk of 0.002 deg/sqrt(h) has a noise of
  // 0.005 deg/h.
  const axiscal::Observations readings =
      axiscal::simulate(truth, axiscal::make_run_sheet(axiscal::standard_design(12), 2, 11),
                        {.noise_sd = 0.005, .seed = 11});

  axiscal::Experiment experiment;
  experiment.instrument = truth.instrument;
  // The calibration does not know the azimuth of the fence.
  experiment.field = axiscal::EarthRotationField(site, "deg/h");
  const axiscal::Calibration result = axiscal::calibrate(experiment, readings);
  for (const axiscal::KindQuantity& quantity : axiscal::quantities_of(result)) {
    if (quantity.name == "fence_azimuth_from_north_deg") {
      std::printf("the fence lies at azimuth %.2f +- %.2f degrees (truth 73.50)\n",
                  quantity.values[0], quantity.u[0]);
      const double error = quantity.values[0] - 73.5;
      std::printf("the error is %s three standard uncertainties\n",
                  error * error < 9.0 * quantity.u[0] * quantity.u[0] ? "within" : "beyond");
    } else if (quantity.name == "latitude_by_table_deg") {
      std::printf("latitude %.2f +- %.2f degrees\n", quantity.values[0], quantity.u[0]);
    }
  }
  return 0;
}
