// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/simulate.hpp"
#include "axiscal/calib/turns.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The procedure of a recording without readings by hand.
enum class RecordingKind {
  free,   ///< turned by hand in all directions, in a field of constant magnitude
  sweep,  ///< at rest, while the temperature goes up and down once
  turns,  ///< rests in the seats of a run sheet, and the turns between them
};

/// @return the kind of that name ("free", "sweep", "turns"), or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<RecordingKind> parse_recording(std::string_view name);

struct Recording {
  RecordingKind kind = RecordingKind::free;
  std::size_t samples = 6000;
  double rate_hz = 100.0;
  /// Of a sweep, which begins and ends at the first.
  std::pair<double, double> temperatures = {0.0, 50.0};
};

/// Where a thing that is moved by hand is, and how fast it turns.
struct HandMotion {
  Eigen::Matrix3d table_from_sensor = Eigen::Matrix3d::Identity();
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();  ///< in the sensor [rad/s]
};

/// One turn from rest to rest about one axis: it begins and ends smoothly, its rate going as 1 -
/// cos(2 pi part).
/// @param part     of the turn's time, 0 to 1.
/// @param seconds  that the whole turn takes.
[[nodiscard]] AXISCAL_EXPORT HandMotion turned_by_hand(const Eigen::Matrix3d& from,
                                                       const Eigen::Matrix3d& to,
                                                       double part,
                                                       double seconds);

/// A recording `free` or `sweep`, a reading for each sample. A sweep lies as the cube nominally
/// does; the truth's temperature terms count.
/// @throws DomainError  as simulate_run(); for fewer than 100 samples.
[[nodiscard]] AXISCAL_EXPORT SimulatedRun simulate_recording(const SensorModel& truth,
                                                             const Recording& recording,
                                                             const SimulationOptions& options = {});

/// A gyroscope's recording of rests and turns.
struct SimulatedTurns {
  std::vector<double> time_s;
  Eigen::MatrixXd readings;                                ///< n x m
  Eigen::MatrixX3d up;                                     ///< in the sensor at each sample, n x 3
  std::vector<std::pair<std::size_t, std::size_t>> rests;  ///< first sample of each, and how many
  Eigen::VectorXd bias_of_run;                             ///< as of a SimulatedRun
};

/// A recording `turns` in the seats of a sheet; two thirds of the time are rests.
/// @param truth  a gyroscope's, in rad/s: its response counts.
/// @param earth_in_table  the Earth's rotation [rad/s].
/// @throws DomainError  as simulate_recording(); for fewer than 30 samples a seat.
[[nodiscard]] AXISCAL_EXPORT SimulatedTurns simulate_turns(const SensorModel& truth,
                                                           const std::vector<RunSheetRow>& sheet,
                                                           const Recording& recording,
                                                           const Eigen::Vector3d& earth_in_table,
                                                           const SimulationOptions& options = {});

/// Calibrates the recording by its turns, with known seats; calibrate_imu() does the same with a
/// log.
/// @param cube  what is believed of the cube.
[[nodiscard]] AXISCAL_EXPORT Calibration
calibrate_turns(const SimulatedTurns& recording,
                const std::vector<RunSheetRow>& sheet,
                const Instrument& instrument,
                const Positioner& cube,
                const Eigen::Matrix3d& rotation_sensor_from_positioner,
                const std::optional<Site>& site);

/// The truth as method magnitude can find it: its frame turned so that the sensitivities have the
/// shape.
[[nodiscard]] AXISCAL_EXPORT SensorModel in_shape(SensorModel truth, MagnitudeShape shape);

}  // namespace axiscal
