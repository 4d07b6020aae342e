// SPDX-License-Identifier: Apache-2.0
// Calibrates six photodiodes on a cube under one lamp. Each diode responds only to light from its
// front.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/reduction.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/core/error.hpp>
#include <axiscal/core/rotation.hpp>
#include <axiscal/field/light_field.hpp>
#include <cmath>
#include <cstdio>

namespace {

axiscal::SensorModel six_photodiodes(const Eigen::Vector3d& lamp) {
  axiscal::SensorModel truth;
  truth.instrument.kind = "optical";
  truth.instrument.unit = "V";
  truth.instrument.axes = {"px", "nx", "py", "ny", "pz", "nz"};
  truth.instrument.one_sided = true;
  truth.field.kind = "light";
  truth.field.in_table = lamp.normalized();
  truth.response.bias = Eigen::VectorXd::Constant(6, 0.02);  // readings in the dark
  truth.response.sensitivity.resize(6, 3);
  for (int k = 0; k < 6; ++k) {
    Eigen::Vector3d boresight = (k % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(k / 2);
    boresight += 0.03 * Eigen::Vector3d(std::sin(k), std::cos(k), std::sin(2 * k));
    truth.response.sensitivity.row(k) = (2.0 + 0.1 * k) * boresight.transpose();
  }
  return truth;
}

axiscal::Calibration calibrated(const axiscal::SensorModel& truth) {
  // Each design point is read with the lamp on (level 1) and off (level 0).
  std::vector<axiscal::DesignEntry> design = axiscal::standard_design(12);
  for (axiscal::DesignEntry entry : axiscal::standard_design(12)) {
    entry.level = 0.0;
    design.push_back(entry);
  }
  const axiscal::Observations readings = axiscal::simulate(
      truth, axiscal::make_run_sheet(design, 2, 5), {.noise_sd = 1e-3, .seed = 5});
  axiscal::Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field = axiscal::LightField();
  experiment.field.in_table = truth.field.in_table;  // method joint needs only a rough value
  return axiscal::calibrate(experiment, readings);
}

}  // namespace

int main() {
  const Eigen::Vector3d aside(0.47, 0.17, 0.87);  // 30 degrees from the table's normal
  const axiscal::SensorModel truth = six_photodiodes(aside);
  const axiscal::Calibration result = calibrated(truth);
  for (const axiscal::KindQuantity& quantity : axiscal::quantities_of(result)) {
    if (quantity.name == "responsivity") {
      std::printf("%s: responsivity %.3f +- %.3f V", quantity.of.c_str(), quantity.values[0],
                  quantity.u[0]);
    } else if (quantity.name == "boresight") {
      std::printf(", boresight %+.3f %+.3f %+.3f\n", quantity.values[0], quantity.values[1],
                  quantity.values[2]);
    }
  }
  // Measures the direction of a light source. Only the diodes that face the source respond.
  const axiscal::Reducer reducer(result);
  const Eigen::Vector3d source = Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
  const Eigen::VectorXd readings = truth.response.at(source).cwiseMax(truth.response.bias);
  const axiscal::ReducedReading reduced = reducer.reduce({readings.data(), 6});
  const double off = std::acos(std::min(1.0, reduced.field_in_sensor.normalized().dot(source)));
  std::printf("error of the direction to a light source: %s\n",
              off < 2e-3 ? "less than 2 mrad" : "2 mrad or more");
  try {
    static_cast<void>(calibrated(six_photodiodes(Eigen::Vector3d::UnitZ())));
  } catch (const axiscal::RefusedError& error) {
    std::printf("lamp straight above: %s\n", error.what());
  }
  return 0;
}
