// SPDX-License-Identifier: Apache-2.0
// Calibrates a magnetometer on a kitchen table. It needs only the site and 12 poses of a cube, but
// no level and no compass.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/core/rotation.hpp>
#include <axiscal/core/units.hpp>
#include <axiscal/field/geomagnetic_field.hpp>
#include <cmath>
#include <cstdio>

int main() {
  // The true conditions: the table is tilted, its y axis points to an azimuth of 137 degrees, and
  // there is iron near the magnetometer.
  const axiscal::Site kitchen{.latitude_deg = 48.14, .longitude_deg = 11.58, .height_m = 520.0};
  const axiscal::GeomagneticField earth(kitchen, 2026.5, "uT");
  axiscal::SensorModel truth;
  truth.instrument = {.kind = "magnetometer", .unit = "uT"};
  truth.field.unit = "uT";
  truth.field.in_table = axiscal::rotation_sloping_from_level({0.012, 0.004}) *
                         axiscal::rotation_table_from_enu(137.0 * axiscal::rad_per_deg) *
                         earth.value_in_enu();
  truth.response.bias = Eigen::Vector3d(31.0, -12.0, 8.0);
  truth.response.sensitivity =
      (Eigen::Matrix3d() << 1.08, 0.04, -0.02, 0.04, 0.95, 0.01, -0.02, 0.01, 1.01).finished();
  const axiscal::Observations readings =
      axiscal::simulate(truth, axiscal::make_run_sheet(axiscal::standard_design(12), 2, 3),
                        {.noise_sd = 0.05, .seed = 3});

  // The calibration knows the place and the date, but not the orientation of the table.
  axiscal::Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field = earth;
  const axiscal::Calibration result = axiscal::calibrate(experiment, readings);

  std::printf("method %s, field %.2f +- %.2f uT (model %s)\n",
              std::string(axiscal::method_name(result.fit.method)).c_str(),
              result.sensor.field.magnitude, result.sensor.field.magnitude_u,
              result.sensor.field.model.c_str());
  for (const axiscal::KindQuantity& quantity : axiscal::quantities_of(result)) {
    if (quantity.name == "hard_iron") {
      std::printf("hard iron %.2f %.2f %.2f uT\n", quantity.values[0], quantity.values[1],
                  quantity.values[2]);
    } else if (quantity.values.size() == 1) {
      std::printf("%s %.2f +- %.2f\n", quantity.name.c_str(), quantity.values[0], quantity.u[0]);
    }
  }
  const double worst =
      (result.sensor.response.sensitivity - truth.response.sensitivity).cwiseAbs().maxCoeff();
  std::printf("largest error of the sensitivities: %s\n",
              worst < 2e-3 ? "less than 0.2 %" : "0.2 % or more");
  return 0;
}
