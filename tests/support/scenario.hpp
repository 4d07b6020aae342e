// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/simulate.hpp"

namespace axiscal::test {

/// An accelerometer in volts with known coefficients, gravity in g.
[[nodiscard]] SensorModel accelerometer_truth();

/// Any response with axes "x", "y", "z", "a3", ...
[[nodiscard]] SensorModel truth_of(const LinearResponse& response,
                                   const std::string& kind = "generic");

/// The experiment that calibrates a truth: its instrument and field.
[[nodiscard]] Experiment experiment_for(const SensorModel& truth);

/// The nominal cube, each of whose normals is known by so much [rad] any way.
[[nodiscard]] Positioner uncertain_cube(double u);

/// What is simulated: a design, its replicates, the table's slope and the noise.
struct Run {
  int points = 12;
  int replicates = 1;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double noise_sd = 0.0;
  std::uint64_t seed = 1;
};

[[nodiscard]] Observations observe(const SensorModel& truth, const Run& run);

/// The observations as an observations file.
[[nodiscard]] std::string observations_text(const SensorModel& truth, const Run& run);

}  // namespace axiscal::test
