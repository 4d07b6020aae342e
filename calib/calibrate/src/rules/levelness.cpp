// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "axiscal/positioner/design_point.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the run numbers of the readings with the rest face and the block of `estimate`.
std::vector<int> runs_of_face(const JudgedRun& run, const LevelnessEstimate& estimate) {
  std::vector<int> runs;
  for (const ReadingResidual& residual : run.calibration.fit.residuals) {
    if (residual.used && residual.point && residual.point->rest() == estimate.point.rest() &&
        residual.block.value_or(estimate.block) == estimate.block) {
      runs.push_back(residual.run);
    }
  }
  return runs;
}

void find_levelness(const JudgedRun& run, Warnings& found) {
  if (run.searched || run.mistakes.culprit) {
    return;  // the search for mistakes has already tested each reading
  }
  const std::optional<Levelness>& levelness = run.calibration.fit.levelness;
  if (!levelness || !levelness->suspect) {
    return;
  }
  const std::vector<int> runs = runs_of_face(run, *levelness->suspect);
  found.add(
      WarningCode::levelness, runs,
      formatted("{}: the table's slope from rest face {} disagrees with the slope from the other "
                "faces (p = {}); look for grit under a foot, a wrong face, a gap at the fence or a "
                "moved table, and take these readings again",
                name_of_runs(runs), face_name(levelness->suspect->point.rest()),
                number_text(levelness->p_value, 2)));
}

}  // namespace

WarningRule levelness_rule() {
  return {.name = "levelness", .find = find_levelness};
}

}  // namespace axiscal
