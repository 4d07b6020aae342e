// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/random.hpp"

namespace axiscal::test {

/// A mistake of the operator, put into good readings on purpose.
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

/// What a search should say of it.
struct SeededMistake {
  Observations observations;
  std::vector<WarningCode> codes;  ///< any of these names it
  std::vector<int> runs;           ///< the readings concerned; empty: not to be checked
};

/// @param size  of tilt, table_moved, drift and saturation: how far a reading moves, in its unit.
[[nodiscard]] SeededMistake seed_mistake(Mistake mistake,
                                         double size,
                                         const SensorModel& truth,
                                         const Observations& good,
                                         RandomStream& random);

/// A run for the culprit search: a random instrument, a slope of 5 mrad in a random direction.
struct RandomRun {
  SensorModel truth;
  Observations good;
};
/// @param noise       of each axis, in its unit (full scale 1).
/// @param replicates  of the design of 12.
[[nodiscard]] RandomRun random_run(const Eigen::Vector3d& noise,
                                   RandomStream& random,
                                   int replicates = 1);

/// Moves one reading in a random direction.
/// @param size  by how much [unit], one for each axis: the length of the direction is 1.
[[nodiscard]] SeededMistake move_reading(const Eigen::Vector3d& size,
                                         const Observations& good,
                                         RandomStream& random);

/// Whether a calibration's first warnings name a mistake.
struct Verdict {
  bool caught = false;  ///< there is a warning
  bool named = false;   ///< the first one, or one as likely, has the code and the readings
};
[[nodiscard]] Verdict judge(const Calibration& calibration, const SeededMistake& mistake);

}  // namespace axiscal::test
