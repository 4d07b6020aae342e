// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/logs/imu.hpp"
#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// The properties of a simulated IMU, and its motion.
struct ImuSimulation {
  LinearResponse accelerometer;                ///< bias [unit], sensitivity [unit per g]
  std::optional<LinearResponse> gyroscope;     ///< bias [unit], sensitivity [unit per rad/s]
  std::optional<LinearResponse> magnetometer;  ///< bias [unit], sensitivity [unit per field unit]
  double accelerometer_sd = 0.0;               ///< standard deviation of a sample [unit]
  double gyroscope_sd = 0.0;
  double magnetometer_sd = 0.0;
  /// The magnetic field in the table's frame: x along the fence, z up [unit of the field].
  Eigen::Vector3d magnetic_in_table = Eigen::Vector3d(0.2, 0.4, -0.9);
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< slope of the table along x and y
  double rate_hz = 100.0;
  double rest_s = 3.0;
  double turn_s = 1.5;
  double hand_shake = 0.05;  ///< standard deviation of the acceleration in the middle of a turn [g]
  std::uint64_t seed = 1;
};

/// Simulates a log of rests in the given attitudes and smooth turns between them. The columns are
/// t, ax ay az, gx gy gz and mx my mz; only the columns of simulated instruments exist.
///
/// @param rotations_table_from_sensor  attitude of each rest, in order.
[[nodiscard]] RecordedLog simulate_imu_log(
    const ImuSimulation& simulation,
    const std::vector<Eigen::Matrix3d>& rotations_table_from_sensor);

/// @return the attitude of a nominal cube for each row of a run sheet: the rotation from the frame
///         `positioner` to the frame `table`.
[[nodiscard]] std::vector<Eigen::Matrix3d> attitudes_of(const std::vector<RunSheetRow>& sheet);

/// @return random attitudes, like those of a board that is turned by hand. Each one is more than 60
///         degrees from the one before.
[[nodiscard]] std::vector<Eigen::Matrix3d> random_attitudes(std::size_t count, std::uint64_t seed);

}  // namespace axiscal
