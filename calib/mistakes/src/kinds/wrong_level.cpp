// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <set>
#include <utility>

#include "axiscal/core/number_text.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::array wrong_level_advice = {
    MistakeAdvice{.code = WarningCode::wrong_level,
                  .one = "Check what the field was set to, or take the reading again."}};

void explain_by_level(const SuspectRun& run, std::size_t i, Explanations& found) {
  std::set<FieldLevel> levels;
  for (const Reading& reading : run.set().readings) {
    levels.insert(reading.level);
  }
  if (!run.set().field.level_can_be_set() ||
      (levels.size() == 1 && *levels.begin() == FieldLevel(1.0))) {
    return;
  }
  if (!run.set().readings[i].level.has_level_per_part()) {
    levels.insert({-1.0, 0.0, 1.0});
  }
  for (const FieldLevel& level : levels) {
    if (level == run.set().readings[i].level) {
      continue;
    }
    ReadingSet set = run.set();
    set.readings[i].level = level;
    Correction correction = about(run, WarningCode::wrong_level, {i});
    correction.levels = {{run.run_of(i), level}};
    found.add(
        run.fitter().fit(set), {},
        static_cast<double>(run.n()) * static_cast<double>(levels.size() - 1),
        std::move(correction),
        formatted("at level {} instead of {}", level.text(), run.set().readings[i].level.text()));
  }
}

}  // namespace

MistakeKind wrong_level_kind() {
  return {.advice = wrong_level_advice, .of_reading = explain_by_level};
}

}  // namespace axiscal
