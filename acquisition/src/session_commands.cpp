// SPDX-License-Identifier: Apache-2.0
// The commands and the end of a session.
#include <utility>

#include "acquisition/src/session_end.hpp"
#include "acquisition/src/session_engine.hpp"
#include "acquisition/src/session_words.hpp"
#include "axiscal/acquisition/assembly_session.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr int most_retake_rounds = 2;

}  // namespace

void Session::Engine::command(const SessionCommand& command) {
  const bool is_way_out = command.action == SessionAction::quit;
  if (is_over()) {
    return;
  }
  if (phase_ == SessionPhase::storing && !is_way_out) {
    news_.tell("refused", "a reading is not stored yet: free some space on the disk");
    return;
  }
  if (phase_ == SessionPhase::paused && command.action != SessionAction::go_on && !is_way_out) {
    news_.tell("refused", "the session is paused: continue the session first");
    return;
  }
  switch (command.action) {
    case SessionAction::capture:
      capture_now();
      break;
    case SessionAction::accept:
      if (phase_ == SessionPhase::question) {
        knowledge_.accept_run(pending_->run);
        store();
      }
      break;
    case SessionAction::as_seen:
      accept_recognised_pose();
      break;
    case SessionAction::retake:
      retake({command.run.value_or(list_.next_run() - 1)}, "retake");
      break;
    case SessionAction::retake_suggested:
      retake(view_.suspects, "retake");
      break;
    case SessionAction::undo:
      if (!list_.readings().empty()) {
        retake({list_.readings().back().run}, "undo");
      }
      break;
    case SessionAction::skip:
      if (wanted_ &&
          change(ReadingList::skipped(*wanted_), "skipped", wanted_row().entry.point.name())) {
        moved_ = true;
        next_point();
      }
      break;
    case SessionAction::replicate:
      if (change(ReadingList::replicate(), "replicate",
                 "one more replicate of the design was added")) {
        next_point();
      }
      break;
    case SessionAction::pause:
      before_pause_ = std::exchange(phase_, SessionPhase::paused);
      news_.tell("paused", "paused; no readings are taken");
      break;
    case SessionAction::go_on:
      if (phase_ == SessionPhase::paused) {
        phase_ = before_pause_;
        interrupt("");
        news_.tell("resumed", "the session goes on");
      } else if (phase_ == SessionPhase::soaking) {
        soaked_ = true;
      }
      break;
    case SessionAction::finish:
      finish();
      break;
    case SessionAction::toggle_automatic:
      view_.automatic = !view_.automatic;
      news_.tell("automatic", view_.automatic ? "readings are taken automatically"
                                              : "readings are taken only on command");
      break;
    case SessionAction::quit:
      quit_ = true;
      flush_raw();
      phase_ = SessionPhase::over;
      news_.tell("quit", formatted("stopped; {} can be resumed", journal_.path()));
      break;
  }
}

void Session::Engine::capture_now() {
  if (phase_ == SessionPhase::soaking) {
    soaked_ = true;
  } else if (phase_ == SessionPhase::question) {
    // The command is not taken as an answer, because it may be a repetition, or may have been given
    // before the question appeared.
    news_.tell("refused", "answer the question first: accept the reading, or lay the cube again");
  } else if ((phase_ == SessionPhase::dwelling || phase_ == SessionPhase::ready) &&
             dwell_.samples() >= fewest_samples_of_dwell) {
    complete();
  } else if (phase_ == SessionPhase::laying && stillness_.is_still()) {
    moved_ = true;  // the command confirms that the cube was placed
  }
}

void Session::Engine::accept_recognised_pose() {
  if (phase_ != SessionPhase::question || !judgement_ || !judgement_->looks_like_another) {
    return;
  }
  const std::optional<std::size_t> step = list_.waiting_for(judgement_->best, *wanted_);
  if (!step) {
    news_.tell("refused",
               judgement_->best.name() +
                   " was taken already: lay the cube as requested, or accept the reading");
    return;
  }
  pending_->step = *step;
  pending_->row = list_.steps()[*step].row;
  store();
}

void Session::Engine::retake(std::vector<int> runs, const std::string& why) {
  bool some = false;
  for (const int run : runs) {
    const CapturedReading* const reading = list_.find(run);
    if (reading == nullptr) {
      news_.tell("refused", formatted("run {} does not exist", run));
      continue;
    }
    const DesignPoint point = reading->row.entry.point;
    some = change(ReadingList::dropped(run, why), why,
                  run_text(run) + " was dropped; the same pose is requested again", run) ||
           some;
    knowledge_.forget(run);
    if (present_ == point && why == "undo") {
      moved_ = false;
    }
  }
  if (some) {
    phase_ = SessionPhase::laying;
    update_pose_model();
    next_point();
  }
}

bool Session::Engine::change(const Json& entry,
                             const std::string& kind,
                             const std::string& text,
                             std::optional<int> run) {
  const std::string why = journal_.append(entry.dump());
  news_.set_alarm("disk", why);
  if (!why.empty()) {
    return false;
  }
  list_.apply(entry);
  news_.tell(kind, text, run);
  return true;
}

void Session::Engine::finish() {
  if (phase_ == SessionPhase::review || (list_.is_finished() && !wanted_)) {
    flush_raw();
    if (list_.is_finished() ||
        change(ReadingList::finished(), "finished", "the session is finished")) {
      phase_ = SessionPhase::over;
    }
    return;
  }
  if (list_.readings().empty()) {
    news_.tell("refused",
               "there are no readings yet: take at least one before you finish, or enter 'quit' to "
               "stop the session");
    return;
  }
  wanted_.reset();
  pending_.reset();
  review();
}

void Session::Engine::review() {
  wanted_.reset();
  if (list_.readings().empty()) {
    phase_ = SessionPhase::over;
    news_.tell("finished", "the session ended without a reading");
    return;
  }
  phase_ = SessionPhase::review;
  calibrations_.clear();
  std::string why_none;
  try {
    calibrations_ = calibrate_session(setup_.experiment, observations());
  } catch (const Error& error) {
    why_none = error.what();
  }
  const SessionReview result =
      review_session(calibrations_, why_none, list_.readings(), knowledge_.suspects());
  view_.result = result.lines;
  view_.suspects = result.again;
  view_.outcomes.clear();
  for (const Calibration& calibration : calibrations_) {
    view_.outcomes.push_back(outcome_of(calibration));
  }
  news_.tell("review", joined(view_.result, "; "));
  if (list_.is_finished()) {
    phase_ = SessionPhase::over;
  } else if (setup_.unattended) {
    if (!view_.suspects.empty() && !samples_ended_ && retake_rounds_ < most_retake_rounds) {
      ++retake_rounds_;
      retake(view_.suspects, "retake");
    } else {
      finish();
    }
  }
}

}  // namespace axiscal
