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

/// The procedure of a continuous recording.
enum class RecordingKind {
  free,   ///< turned by hand in all directions, in a field of constant magnitude
  sweep,  ///< at rest, while the temperature goes up and down once
  turns,  ///< at rest at each design point of a run sheet, and turned from point to point
};

/// @return the kind of that name ("free", "sweep", "turns"), or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<RecordingKind> parse_recording(std::string_view name);

struct Recording {
  RecordingKind kind = RecordingKind::free;
  std::size_t samples = 6000;
  double rate_hz = 100.0;
  /// The temperatures of a sweep: it starts at the first, goes to the second, and returns to the
  /// first.
  std::pair<double, double> temperatures = {0.0, 50.0};
};

/// The attitude and angular rate of an instrument that is turned by hand.
struct HandMotion {
  Eigen::Matrix3d table_from_sensor = Eigen::Matrix3d::Identity();
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();  ///< angular rate, frame sensor [rad/s]
};

/// Returns the motion during a turn about one axis that begins and ends at rest. The rate is
/// proportional to 1 - cos(2 pi part), so the turn begins and ends smoothly.
/// @param from, to  the attitudes before and after the turn, as rotation_table_from_sensor.
/// @param part     the elapsed fraction of the turn's time, 0 to 1.
/// @param seconds  the duration of the whole turn.
[[nodiscard]] AXISCAL_EXPORT HandMotion hand_motion(const Eigen::Matrix3d& from,
                                                    const Eigen::Matrix3d& to,
                                                    double part,
                                                    double seconds);

/// Simulates a recording `free` or `sweep`, with one reading for each sample. During a sweep the
/// cube's edges lie along the axes of the table. The readings follow the temperature terms of
/// `truth`.
/// @throws DomainError  as simulate_run(), or if there are fewer than 100 samples.
[[nodiscard]] AXISCAL_EXPORT SimulatedRun simulate_recording(const SensorModel& truth,
                                                             const Recording& recording,
                                                             const SimulationOptions& options = {});

/// A gyroscope's recording of periods of rest, with turns between them.
struct SimulatedTurns {
  std::vector<double> time_s;
  Eigen::MatrixXd readings;  ///< n x m
  /// n x 3: the upward vertical at each sample, as a unit vector in the frame `sensor`.
  Eigen::MatrixX3d up;
  /// For each period of rest, the index of its first sample and its number of samples.
  std::vector<std::pair<std::size_t, std::size_t>> rests;
  Eigen::VectorXd bias_of_run;  ///< mean of the random walk; see SimulatedRun::bias_of_run
};

/// Simulates a recording of the kind `turns`: the cube rests at each design point of a run sheet,
/// and is turned from point to point. It is at rest for two thirds of the time.
/// @param truth  a gyroscope. Only its response to an angular rate in rad/s is used.
/// @param earth_in_table  the Earth's rotation in the frame table [rad/s].
/// @throws DomainError  as simulate_recording(), or if there are fewer than 30 samples for each row
///                      of `sheet`.
[[nodiscard]] AXISCAL_EXPORT SimulatedTurns simulate_turns(const SensorModel& truth,
                                                           const std::vector<RunSheetRow>& sheet,
                                                           const Recording& recording,
                                                           const Eigen::Vector3d& earth_in_table,
                                                           const SimulationOptions& options = {});

/// Calibrates a gyroscope by the turns of a simulated recording. The orientations at rest are taken
/// from `sheet`. calibrate_imu() is the corresponding function for a real log.
/// @param cube  the cube that the calibration assumes.
[[nodiscard]] AXISCAL_EXPORT Calibration
calibrate_turns(const SimulatedTurns& recording,
                const std::vector<RunSheetRow>& sheet,
                const Instrument& instrument,
                const Positioner& cube,
                const Eigen::Matrix3d& rotation_sensor_from_positioner,
                const std::optional<Site>& site);

/// @return the truth in the frame that method magnitude uses. It is rotated so that its sensitivity
///         matrix has the given shape.
[[nodiscard]] AXISCAL_EXPORT SensorModel rotated_to_shape(SensorModel truth, MagnitudeShape shape);

}  // namespace axiscal
