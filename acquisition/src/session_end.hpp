// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"
#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// The uncertainty that a session will end with, by the points done and still to be done.
///
/// @param nominal   current knowledge of instrument and field; three axes, gravity.
/// @param noise_sd  of a reading, as seen so far [unit].
/// @return expanded uncertainty of the worst angle [deg]; nullopt if it is unknown.
[[nodiscard]] std::optional<double> expected_angle_u_deg(const Experiment& experiment,
                                                         const std::vector<SessionStep>& steps,
                                                         const SensorModel& nominal,
                                                         double noise_sd);

/// The result of a session in words, and the runs to repeat.
struct SessionReview {
  std::vector<std::string> lines;
  std::vector<int> again;  ///< ascending
};

/// Suggests the runs that the culprit search names and those that were too noisy.
///
/// @param calibrations  none where there is none; `why_none` says why.
/// @param readings     none of a session without a cube.
/// @param suspects     runs that looked wrong on the way.
[[nodiscard]] SessionReview review_session(const std::vector<Calibration>& calibrations,
                                           const std::string& why_none,
                                           const std::vector<CapturedReading>& readings,
                                           const std::set<int>& suspects);

}  // namespace axiscal
