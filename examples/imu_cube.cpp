// SPDX-License-Identifier: Apache-2.0
// Calibrates an IMU in a 3-D printed cube. One log is recorded while the cube is placed on its
// faces, and gives three records. The poses are recognised, so no run sheet and no turntable are
// needed.
#include <axiscal/calib/calibration_json.hpp>
#include <axiscal/core/units.hpp>
#include <axiscal/logs/imu.hpp>
#include <axiscal/logs/simulate_log.hpp>
#include <cstdio>
#include <string>
#include <vector>

int main() {
  // The true IMU, which the calibration does not know: raw counts of an MPU-9250 with errors of
  // some per cent.
  axiscal::ImuSimulation imu;
  imu.accelerometer.bias = Eigen::Vector3d(120.0, -340.0, 560.0);
  imu.accelerometer.sensitivity = 16384.0 * Eigen::Matrix3d::Identity();
  imu.accelerometer.sensitivity(0, 1) = 90.0;
  imu.gyroscope = axiscal::LinearResponse{
      .bias = Eigen::Vector3d(35.0, -12.0, 8.0),
      .sensitivity = 131.0 * axiscal::deg_per_rad * 1.02 * Eigen::Matrix3d::Identity()};
  imu.magnetometer = axiscal::LinearResponse{.bias = Eigen::Vector3d(40.0, -25.0, 60.0),
                                             .sensitivity = 300.0 * Eigen::Matrix3d::Identity()};
  imu.accelerometer_sd = 40.0;
  imu.gyroscope_sd = 6.0;
  imu.magnetometer_sd = 1.0;
  imu.slope = {0.01, -0.02};  // slope of a kitchen table
  const axiscal::RecordedLog log = axiscal::simulate_imu_log(
      imu, axiscal::attitudes_of(axiscal::make_run_sheet(axiscal::standard_design(12), 1, 5)));

  axiscal::ImuOptions options;
  options.accelerometer = {"ax", "ay", "az"};
  options.gyroscope = {"gx", "gy", "gz"};
  options.magnetometer = {"mx", "my", "mz"};
  options.seats = axiscal::Seats::recognised;
  const axiscal::ImuCalibration found = axiscal::calibrate_imu(log, options);

  std::printf("%zu rests, %zu turns\n", found.rests.intervals.size(),
              found.turns->residuals.size());
  for (const std::string& note : found.notes) {
    std::printf("%s\n", note.c_str());
  }
  for (const axiscal::Calibration& record : found.records()) {
    // Parameters are named after the column of the axis in the log, for example "ax.bias".
    const std::vector<std::string>& axes = record.sensor.instrument.axes;
    std::printf(
        "%s (method %s): bias %.1f %.1f %.1f, sensitivity of x "
        "%.1f\n",
        record.provenance.slot.c_str(),
        std::string(axiscal::method_name(record.fit.method)).c_str(),
        record.parameter(axes[0] + ".bias").value, record.parameter(axes[1] + ".bias").value,
        record.parameter(axes[2] + ".bias").value,
        record.parameter(axes[0] + ".sensitivity.x").value);
    // axiscal::calibration_json(record) returns the text of a record file.
    if (axiscal::calibration_json(record).empty()) {
      return 1;
    }
  }
  const double scale_error =
      found.gyroscope->parameter("gz.sensitivity.z").value / imu.gyroscope->sensitivity(2, 2) - 1.0;
  std::printf("error of the scale of gz: %.3f %%\n", 100.0 * scale_error);
  return 0;
}
