// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/random.hpp"

namespace axiscal::test {

/// A mistake that is put into good readings.
enum class Mistake {
  none,
  wrong_face,
  upside_down,
  wrong_way_round,
  exchanged,
  columns,
  sign,
  unit_factor,
  repeat,
  tilt,
  table_moved,
  drift,
  saturation,
};

[[nodiscard]] const char* name_of(Mistake mistake);

/// Readings with a mistake, and the expected result of the search.
struct SeededMistake {
  Observations observations;
  std::vector<WarningCode> codes;  ///< the warning must have one of these codes
  std::vector<int> runs;           ///< the wrong readings; empty: any
};

/// @param size  change of a reading [its unit], for tilt, table_moved, drift and saturation.
[[nodiscard]] SeededMistake seed_mistake(Mistake mistake,
                                         double size,
                                         const SensorModel& truth,
                                         const Observations& good,
                                         RandomStream& random);

/// A run of a random instrument on a table that slopes by 5 mrad in a random direction.
struct RandomRun {
  SensorModel truth;
  Observations good;
};
/// @param noise       sd of each axis [its unit; full scale is 1].
/// @param replicates  number of repetitions of the 12 points.
[[nodiscard]] RandomRun random_run(const Eigen::Vector3d& noise,
                                   RandomStream& random,
                                   int replicates = 1);

/// Moves one reading in a random direction of length 1.
/// @param size  factor for each axis [unit of the readings].
[[nodiscard]] SeededMistake move_reading(const Eigen::Vector3d& size,
                                         const Observations& good,
                                         RandomStream& random);

/// Result of a comparison of a calibration's first warnings with a mistake.
struct Verdict {
  bool caught = false;  ///< the calibration has a warning
  bool named = false;   ///< the first or an equally likely one is right
};
[[nodiscard]] Verdict judge(const Calibration& calibration, const SeededMistake& mistake);

}  // namespace axiscal::test
