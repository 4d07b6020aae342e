// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/simulate.hpp"

namespace axiscal::test {

/// An accelerometer in volts with known coefficients. The field is gravity in g.
[[nodiscard]] SensorModel accelerometer_truth();

/// A sensor with any response. Its axes are "x", "y", "z", "a3", ...
[[nodiscard]] SensorModel truth_of(const LinearResponse& response,
                                   const std::string& kind = "generic");

/// @return an experiment with the instrument and the field of a truth.
[[nodiscard]] Experiment experiment_for(const SensorModel& truth);

/// The nominal cube. Each normal has the standard uncertainty `u` [rad] in both directions.
[[nodiscard]] Positioner uncertain_cube(double u);

/// Parameters of a simulated run: design, replicates, slope of the table, noise.
struct Run {
  int points = 12;
  int replicates = 1;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double noise_sd = 0.0;
  std::uint64_t seed = 1;
};

[[nodiscard]] Observations observe(const SensorModel& truth, const Run& run);

/// @return simulated readings as the text of a readings file.
[[nodiscard]] std::string observations_text(const SensorModel& truth, const Run& run);

}  // namespace axiscal::test
