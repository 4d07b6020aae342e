// SPDX-License-Identifier: Apache-2.0
// Calibrations for exports, and readings that test the exports.
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/random.hpp"

namespace axiscal::test {

inline Calibration accelerometer_in(const std::string& unit, const std::string& field_unit) {
  Calibration calibration;
  calibration.provenance.created = "2026-11-21T10:00:00Z";
  calibration.provenance.software = "axiscal test";
  calibration.sensor.instrument = {.kind = "accelerometer", .serial = "A-17", .unit = unit};
  calibration.sensor.field = {
      .kind = "gravity", .unit = field_unit, .magnitude = field_unit == "g" ? 1.0 : 9.81};
  if (field_unit == "g") {
    calibration.sensor.field.local_gravity = 9.81;
  }
  calibration.sensor.response.bias = Eigen::Vector3d(0.1, -0.2, 0.3);
  calibration.sensor.response.sensitivity =
      Eigen::Matrix3d({{1.0, 0.02, -0.01}, {0.015, 0.98, 0.02}, {-0.02, 0.01, 1.03}});
  return calibration;
}

inline Calibration without_cross_axis_terms(Calibration calibration) {
  const Eigen::Vector3d scale = calibration.sensor.response.sensitivity.diagonal();
  calibration.sensor.response.sensitivity = Eigen::Matrix3d(scale.asDiagonal());
  return calibration;
}

inline Calibration gyroscope() {
  Calibration calibration = accelerometer_in("rad/s", "m/s^2");
  calibration.sensor.instrument.kind = "gyroscope";
  calibration.sensor.field = {.kind = "induced_rotation", .unit = "rad/s", .magnitude = 1.0};
  calibration.sensor.response.bias *= 0.01;
  return calibration;
}

/// A magnetometer in uT. The inverse of its sensitivity is symmetric.
inline Calibration magnetometer() {
  Calibration calibration = accelerometer_in("uT", "m/s^2");
  calibration.sensor.instrument.kind = "magnetometer";
  calibration.sensor.field = {.kind = "geomagnetic", .unit = "uT", .magnitude = 48.0};
  calibration.sensor.response.bias = Eigen::Vector3d(12.0, -7.0, 30.0);
  calibration.sensor.response.sensitivity =
      Eigen::Matrix3d({{1.1, 0.05, -0.02}, {0.05, 0.9, 0.03}, {-0.02, 0.03, 1.0}});
  return calibration;
}

inline Calibration over_temperature(Calibration calibration) {
  TemperatureResponse over{.spans = {{.reference = 25.0, .low = -10.0, .high = 60.0}}};
  over.bias = Eigen::MatrixXd(3, 2);
  over.bias << 1e-3, 2e-5, -2e-3, 1e-5, 5e-4, -3e-5;
  over.scale = Eigen::MatrixXd(3, 2);
  over.scale << 1e-4, 1e-6, -2e-4, 2e-6, 3e-4, -1e-6;
  over.bias_se = over.scale_se = Eigen::MatrixXd::Constant(3, 2, 1e-7);
  calibration.sensor.temperature = over;
  return calibration;
}

/// A field in some direction, and the reading of the instrument in this field.
struct Trial {
  Eigen::Vector3d field;
  Eigen::Vector3d reading;
  double temperature = 25.0;
};

inline std::vector<Trial> trials(const Calibration& calibration) {
  RandomStream random(11);
  std::vector<Trial> all;
  for (int i = 0; i < 50; ++i) {
    Trial trial;
    trial.field = calibration.sensor.field.magnitude * random.normals<3>().normalized();
    trial.temperature = calibration.sensor.temperature ? -10.0 + 70.0 * random.uniform() : 25.0;
    trial.reading = response_at(calibration.sensor, trial.field, trial.temperature);
    all.push_back(trial);
  }
  return all;
}

/// @return the field that apply computes from a reading.
inline Eigen::Vector3d applied(const Calibration& calibration, const Trial& trial) {
  const Reducer reducer(calibration);
  const std::array<double, 3> v = {trial.reading(0), trial.reading(1), trial.reading(2)};
  return reducer.reduce(v, {.temperature = trial.temperature}).field_in_sensor;
}

}  // namespace axiscal::test
