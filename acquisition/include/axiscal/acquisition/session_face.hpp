// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "axiscal/acquisition/live_session.hpp"
#include "axiscal/acquisition/sample_feed.hpp"
#include "axiscal/acquisition/session.hpp"

namespace axiscal {

/// What a person, or a program, sees of a session and says to it.
class SessionFace {
 public:
  SessionFace() = default;
  virtual ~SessionFace() = default;
  SessionFace(const SessionFace&) = delete;
  SessionFace& operator=(const SessionFace&) = delete;

  /// Shows how things stand, some twenty times a second, and what happened since the last time.
  /// Must not wait.
  virtual void show(const SessionView& view, const std::vector<SessionEvent>& events) = 0;

  /// @return what was asked for since the last time. Must not wait.
  virtual std::vector<SessionCommand> commands() = 0;

  /// Shows what a session came to until it was seen, where there is somebody to see it.
  /// @param files  that it leaves.
  /// @return whether the same is wanted once more.
  [[nodiscard]] virtual bool conclude(const SessionView& /*view*/,
                                      const std::vector<SessionFile>& /*files*/) {
    return false;
  }

  /// @return whether anything can still be asked for.
  [[nodiscard]] virtual bool can_answer() const { return true; }
};

/// Lines of words on standard output, commands as words on standard input: for screen readers and
/// scripts.
/// @param reads_commands  whether standard input has commands (it may have the samples).
[[nodiscard]] std::unique_ptr<SessionFace> make_plain_face(bool reads_commands);

/// Events as JSON lines on standard output, and a view with each; commands as make_plain_face().
[[nodiscard]] std::unique_ptr<SessionFace> make_json_face(bool reads_commands);

/// A whole terminal of 80 x 24 or more, by ncurses.
/// @param title  of the session.
/// @throws DomainError  where this build has no ncurses, or there is no such terminal.
[[nodiscard]] std::unique_ptr<SessionFace> make_terminal_face(const std::string& title);

/// Runs a session until it is over: samples from the feed, commands from the faces.
///
/// A recording that ends before the session leaves it to the faces; where there is nobody to answer
/// it is finished with what there is. A question that nobody can answer, as standard input is
/// closed, ends it after some seconds: a review is finished, all else can be resumed.
/// @param unattended  nobody answers.
/// @param reviewed    is called each time a review begins, so that results can be stored before
///                    anybody answers it; may be empty.
/// @throws Error  as Session::set_channels(), Session::add(), SampleFeed::read().
void run_session(LiveSession& session,
                 SampleFeed& feed,
                 const std::vector<SessionFace*>& faces,
                 bool unattended,
                 const std::function<void()>& reviewed = {});

}  // namespace axiscal
