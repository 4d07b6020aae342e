// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"
#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// Predicts the uncertainty of a direction at the end of a session, from all its points that are
/// not skipped.
///
/// @param nominal   current estimate of the instrument (three axes) and the field (gravity).
/// @param noise_sd  standard deviation of a reading, estimated from the readings so far [unit].
/// @return the largest standard uncertainty of a direction [deg]; nullopt if it is unknown.
[[nodiscard]] std::optional<double> expected_angle_u_deg(const Experiment& experiment,
                                                         const std::vector<SessionStep>& steps,
                                                         const SensorModel& nominal,
                                                         double noise_sd);

/// The result of a session as text, and the readings to repeat.
struct SessionReview {
  std::vector<std::string> lines;
  std::vector<int> again;  ///< run numbers of the readings to repeat, in ascending order
};

/// Describes the result, and suggests which readings to repeat: those in `suspects`, those that the
/// calibrations suggest to repeat, and those that scatter too much.
///
/// @param calibrations  the results; empty if the calibration failed.
/// @param why_none      the reason for the failure.
/// @param readings      the readings; empty for a session without a cube.
/// @param suspects      run numbers of the readings that fitted another pose during the session.
[[nodiscard]] SessionReview review_session(const std::vector<Calibration>& calibrations,
                                           const std::string& why_none,
                                           const std::vector<CapturedReading>& readings,
                                           const std::set<int>& suspects);

}  // namespace axiscal
