// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibrate.hpp"

namespace axiscal {
namespace {

// Applies a correction to the readings. The run numbers of readings that the correction leaves out
// are added to Experiment::leave_out.
void follow(const Correction& correction, Experiment& experiment, Observations& observations) {
  observations = corrected(std::move(observations), correction);
  experiment.leave_out.insert(experiment.leave_out.end(), correction.leave_out.begin(),
                              correction.leave_out.end());
}

}  // namespace

Calibration calibrate_with_suggestions(Experiment experiment, Observations observations) {
  std::vector<Correction> made;
  Calibration calibration = calibrate(experiment, observations);
  constexpr std::size_t most = 3;  // a run that needs more corrections is unreliable
  while (calibration.findings.suggestion && made.size() < most) {
    const Correction correction = *calibration.findings.suggestion;
    const bool mends = !correction.points.empty() || !correction.responses.empty() ||
                       !correction.levels.empty() || !correction.leave_out.empty();
    if (!mends) {
      break;
    }
    follow(correction, experiment, observations);
    made.push_back(correction);
    calibration = calibrate(experiment, observations);
  }
  for (const Correction& correction : made) {
    calibration.findings.notes.push_back(
        {NoteCode::corrected, "corrected as suggested: " + correction.message});
  }
  calibration.findings.corrections = std::move(made);
  return calibration;
}

}  // namespace axiscal
