// SPDX-License-Identifier: Apache-2.0
// Calibrates in a Helmholtz coil around the cube, with the current in both directions. Readings
// with opposite currents separate the Earth's field from the field of the coil.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/field/coil_field.hpp>
#include <axiscal/field/geomagnetic_field.hpp>
#include <cstdio>

int main() {
  const axiscal::Coil helmholtz{.shape = axiscal::CoilShape::helmholtz,
                                .turns = 40.0,
                                .current_A = 0.3,
                                .size_m = 0.2,
                                .axis_in_table = {0.1, 0.0, 1.0}};
  const axiscal::CoilField coil(helmholtz, "uT");
  std::printf("the coil makes %.2f uT\n", coil.magnitude());

  axiscal::SensorModel truth;
  truth.instrument = {.kind = "magnetometer", .unit = "uT"};
  truth.field.unit = "uT";
  axiscal::FieldDescription earth;
  earth.kind = "geomagnetic";
  earth.in_table = Eigen::Vector3d(8.0, 18.0, -43.0);
  earth.set_by_level = false;
  axiscal::FieldDescription made;
  made.kind = "induced_magnetic";
  made.in_table = coil.value_in_enu();
  truth.field.parts = {earth, made};
  truth.response.bias = Eigen::Vector3d(5.0, -3.0, 1.0);
  truth.response.sensitivity = 0.98 * Eigen::Matrix3d::Identity();

  // Each design point is read with the current in both directions: level +1 and -1.
  std::vector<axiscal::DesignEntry> design = axiscal::standard_design(12);
  for (axiscal::DesignEntry entry : axiscal::standard_design(12)) {
    entry.level = -1.0;
    design.push_back(entry);
  }
  const axiscal::Observations readings = axiscal::simulate(
      truth, axiscal::make_run_sheet(design, 1, 9), {.noise_sd = 0.02, .seed = 9});

  // The calibration knows the coil and the magnitude of the Earth's field, but not its direction.
  axiscal::Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field = axiscal::GeomagneticField();
  experiment.field.unit = "uT";
  experiment.field.magnitude = earth.in_table->norm();
  experiment.field += coil;
  const axiscal::Calibration result = axiscal::calibrate(experiment, readings);
  const Eigen::Vector3d found = *result.sensor.field.parts[0].in_table;
  std::printf("the Earth's field in the table's frame: %.1f %.1f %.1f uT\n", found.x(), found.y(),
              found.z());
  const axiscal::Quantity sensitivity = result.parameter("z.sensitivity.z");
  std::printf("sensitivity of z %.4f +- %.4f (95 %%)\n", sensitivity.value, sensitivity.U);
  return 0;
}
