// SPDX-License-Identifier: Apache-2.0
// Calibrates the IMU of a bare board. The board is turned by hand, and rests in any attitude
// between the turns. The magnitude of gravity calibrates the accelerometer, and the turns calibrate
// the gyroscope.
#include <axiscal/core/units.hpp>
#include <axiscal/logs/imu.hpp>
#include <axiscal/logs/simulate_log.hpp>
#include <cmath>
#include <cstdio>

int main() {
  axiscal::ImuSimulation imu;
  imu.accelerometer.bias = Eigen::Vector3d(0.05, -0.02, 0.11);
  imu.accelerometer.sensitivity = 1.01 * Eigen::Matrix3d::Identity();
  imu.accelerometer.sensitivity(0, 2) = 0.015;
  imu.gyroscope = axiscal::LinearResponse{.bias = Eigen::Vector3d(0.6, -0.3, 0.2),
                                          .sensitivity = 56.9 * Eigen::Matrix3d::Identity()};
  imu.gyroscope->sensitivity(1, 0) = 0.8;
  imu.accelerometer_sd = 4e-3;
  imu.gyroscope_sd = 0.1;
  const axiscal::RecordedLog log = axiscal::simulate_imu_log(imu, axiscal::random_attitudes(30, 3));

  axiscal::ImuOptions options;
  options.accelerometer = {"ax", "ay", "az"};
  options.gyroscope = {"gx", "gy", "gz"};
  options.gyroscope_unit = "deg/s";
  // With a triangular matrix, az measures along the z axis of the sensor's frame.
  options.experiment.fit.shape = axiscal::MagnitudeShape::triangular;
  const axiscal::ImuCalibration found = axiscal::calibrate_imu(log, options);

  std::printf("%zu rests, threshold of the variance %.2g, attitude error %.2f degrees\n",
              found.rests.intervals.size(), found.rests.threshold,
              found.turns->residual_sd_rad * axiscal::deg_per_rad);
  double worst = 0.0;  // largest |error| / standard uncertainty
  const auto compare = [&worst](const axiscal::Calibration& record,
                                const axiscal::LinearResponse& truth) {
    const std::vector<std::string>& axes = record.sensor.instrument.axes;
    for (std::size_t k = 0; k < 3; ++k) {
      for (Eigen::Index j = 0; j < 3; ++j) {
        const axiscal::Quantity found_one = record.parameter(axes[k] + ".sensitivity." + "xyz"[j]);
        if (found_one.u > 0.0) {
          const double exact = truth.sensitivity(static_cast<Eigen::Index>(k), j);
          worst = std::max(worst, std::abs(found_one.value - exact) / found_one.u);
        }
      }
    }
  };
  compare(found.accelerometer, imu.accelerometer);
  compare(*found.gyroscope, *imu.gyroscope);
  std::printf("%s four standard uncertainties of the truth\n",
              worst < 4.0 ? "all 15 sensitivities within"
                          : "at least one of the 15 sensitivities is NOT within");
  return 0;
}
