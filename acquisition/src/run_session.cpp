// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <optional>
#include <thread>

#include "acquisition/src/sample_clock.hpp"
#include "axiscal/acquisition/session_face.hpp"

namespace axiscal {
namespace {

constexpr double show_every_s = 0.05;

// Tells a simulated person which point is requested, and whether the cube has a wrong pose.
class Asking {
 public:
  void tell(const SessionView& view, SampleFeed& feed) {
    const bool waits = view.phase == SessionPhase::laying || view.phase == SessionPhase::settling;
    const bool warns = view.phase == SessionPhase::question || view.lies_as_before;
    if (!view.wanted || !(waits || warns)) {
      return;
    }
    // The request is not repeated if only its warning has ended.
    if (told_ != view.wanted->run || done_ != view.done || (warns && !warned_)) {
      feed.request(&view.wanted->entry, warns);
    }
    told_ = view.wanted->run;
    done_ = view.done;
    warned_ = warns;
  }

 private:
  std::optional<int> told_;
  std::size_t done_ = 0;
  bool warned_ = false;
};

// Detects a session that waits for an answer although no face can receive commands, for example
// because standard input is closed.
class Unanswered {
 public:
  // True if the session has waited long enough to end.
  bool is_over(const SessionView& view, bool nobody_answers) {
    const bool waits = view.phase == SessionPhase::question || view.phase == SessionPhase::review ||
                       view.phase == SessionPhase::paused ||
                       (view.phase == SessionPhase::ready && !view.automatic);
    // In manual mode, a knock may change the phase while the session waits for the same command.
    // Therefore the number of completed points is compared instead of the phase.
    const bool same = view.automatic ? view.phase == phase_ : view.done == done_;
    if (!nobody_answers || !same) {
      since_s_ = never;
    }
    phase_ = view.phase;
    done_ = view.done;
    if (!waits) {
      return false;
    }
    const double now_s = session_seconds();
    since_s_ = std::min(since_s_, now_s);
    constexpr double patience_s = 3.0;
    return nobody_answers && now_s - since_s_ > patience_s;
  }

 private:
  SessionPhase phase_ = SessionPhase::waiting;
  std::size_t done_ = 0;
  static constexpr double never = std::numeric_limits<double>::infinity();
  double since_s_ = never;
};

// Finishes a session with the readings so far. The first `finish` starts the review, the second one
// accepts its result. A session that cannot be finished is stopped, so that it can be resumed.
void end(LiveSession& session) {
  session.command({.action = SessionAction::finish, .run = {}});
  session.command({.action = SessionAction::finish, .run = {}});
  if (!session.is_over()) {
    session.command({.action = SessionAction::quit, .run = {}});
  }
}

}  // namespace

void run_session(LiveSession& session,
                 SampleFeed& feed,
                 const std::vector<SessionFace*>& faces,
                 bool unattended,
                 const std::function<void()>& reviewed) {
  SampleBatch batch;
  Asking asking;
  Unanswered unanswered;
  std::vector<SessionEvent> unseen;
  bool has_channels = false;
  bool said_ended = false;
  SessionPhase phase = SessionPhase::waiting;
  double shown_s = -show_every_s;
  while (!session.is_over()) {
    batch.clear();
    constexpr std::chrono::milliseconds patience{20};
    feed.read(batch, patience);
    if (!has_channels && !feed.channels().empty()) {
      session.set_channels(feed.channels(), feed.time_at_zero());
      has_channels = true;
    }
    for (std::size_t i = 0; i < batch.size() && has_channels && !session.is_over(); ++i) {
      session.add(batch.time_s[i], batch.row(i));
    }
    if (batch.size() == 0) {
      session.idle(feed.silence_s());
    }
    session.set_source_alarms(feed.alarms());
    if (batch.size() == 0 && !feed.is_live()) {
      std::this_thread::sleep_for(patience);
    }
    const bool nobody_answers =
        unattended || std::none_of(faces.begin(), faces.end(), [](const SessionFace* face) {
          return face->accepts_commands();
        });
    if (feed.has_ended() && batch.size() == 0) {
      session.end_of_samples();
      if (nobody_answers && !std::exchange(said_ended, true)) {
        end(session);
      }
    }
    if (unanswered.is_over(session.view(), nobody_answers && !unattended)) {
      if (session.view().phase == SessionPhase::review) {
        end(session);
      } else {
        session.command({.action = SessionAction::quit, .run = {}});
      }
    }
    for (SessionFace* const face : faces) {
      for (const SessionCommand& command : face->commands()) {
        session.command(command);
      }
    }
    const SessionView& view = session.view();
    if (view.phase == SessionPhase::review && phase != SessionPhase::review && reviewed) {
      reviewed();
    }
    phase = view.phase;
    asking.tell(view, feed);
    for (SessionEvent& event : session.take_events()) {
      unseen.push_back(std::move(event));
    }
    const double now_s = session_seconds();
    if (!unseen.empty() || now_s - shown_s >= show_every_s || session.is_over()) {
      shown_s = now_s;
      for (SessionFace* const face : faces) {
        face->show(view, unseen);
      }
      unseen.clear();
    }
  }
}

}  // namespace axiscal
