// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/session_words.hpp"

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

std::string laying_words(const SessionView& view) {
  const bool is_step = view.present_level && *view.present_level != view.wanted->entry.level;
  std::vector<std::string> words;
  for (const CubeTurn turn : view.turns) {
    words.emplace_back(turn_words(turn));
  }
  const std::string way = joined(words, ", then ");
  std::string text = view.phase == SessionPhase::settling ? "let go; the cube is nearly still"
                     : view.lies_as_before                ? "the cube lies as it did at the last "
                                                            "reading: " +
                                                 way
                     : !way.empty() ? way
                     : is_step      ? "leave the cube as it lies"
                     : view.present ? "lift the cube, wipe its feet, and lay it down the same way"
                                    : "";
  if (is_step || view.wanted->entry.level != FieldLevel(1.0)) {
    text += formatted("{}set the field to level {}", text.empty() ? "" : "; ",
                      view.wanted->entry.level.text());
  }
  return text;
}

std::string soaking_words(const MessageContext& besides) {
  if (!besides.has_temperature) {
    return "the temperature is not measured; continue when the requested temperature is reached";
  }
  return besides.soak_remaining_s > 0.0
             ? formatted("about {} min to go", number_text(besides.soak_remaining_s / 60.0, 2))
             : "waiting until the temperature is steady";
}

}  // namespace

std::string run_text(int run) {
  return formatted("run {}", run);
}

std::string question_text(const PoseJudgement& judgement, const DesignPoint& stated) {
  if (!judgement.looks_like_another) {
    return "the reading agrees with no pose of the cube: is there grit under a foot? Does the cube "
           "touch the fence?";
  }
  const DesignPoint& best = judgement.best;
  return best.rest() == stated.rest()
             ? formatted("the reading shows face {} at the fence, not {}", face_name(best.fence()),
                         face_name(stated.fence()))
             : formatted("the reading shows {}, not {}", best.name(), stated.name());
}

void set_next_step_text(SessionView& view, const MessageContext& besides) {
  view.headline.clear();
  view.detail.clear();
  switch (view.phase) {
    case SessionPhase::waiting:
      view.headline = "Waiting for the first sample";
      break;
    case SessionPhase::soaking:
      view.headline = "Soak at " + number_text(*view.wanted->temperature);
      view.detail = soaking_words(besides);
      break;
    case SessionPhase::laying:
    case SessionPhase::settling:
      view.headline = formatted("Face {} on the table, face {} at the fence",
                                face_name(view.wanted->entry.point.rest()),
                                face_name(view.wanted->entry.point.fence()));
      view.detail = laying_words(view);
      break;
    case SessionPhase::dwelling:
      view.headline = "The reading is being taken";
      view.detail = "do not touch the cube";
      break;
    case SessionPhase::ready:
      view.headline = "Ready: take the reading";
      break;
    case SessionPhase::question:
      view.headline = question_text(*besides.judgement, view.wanted->entry.point);
      view.detail =
          formatted("lay the cube as {}, or accept the reading", view.wanted->entry.point.name());
      break;
    case SessionPhase::storing:
      view.headline = "The reading is not stored yet";
      view.detail = "do not move the cube; free some space on the disk";
      break;
    case SessionPhase::paused:
      view.headline = "Paused";
      break;
    case SessionPhase::review:
      view.headline = view.suspects.empty() ? "All points are done" : "Some points look wrong";
      view.detail = joined(view.result, "; ");
      break;
    case SessionPhase::over:
      view.headline = besides.has_quit            ? "Stopped"
                      : view.outcomes.size() == 1 ? view.outcomes.front().verdict
                                                  : "Done";
      view.detail = joined(view.result, "; ");
      break;
  }
}

}  // namespace axiscal
