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

/// The user interface of a session, for a person or a program.
class SessionFace {
 public:
  SessionFace() = default;
  virtual ~SessionFace() = default;
  SessionFace(const SessionFace&) = delete;
  SessionFace& operator=(const SessionFace&) = delete;

  /// Displays the state, about twenty times a second, and the events since the last call. Must not
  /// block.
  virtual void show(const SessionView& view, const std::vector<SessionEvent>& events) = 0;

  /// @return the commands since the last call. Must not block.
  virtual std::vector<SessionCommand> commands() = 0;

  /// Displays the result of a session until a person has seen it, if there is one.
  /// @param files  that it leaves.
  /// @return true if another session is wanted.
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
/// @throws DomainError  if this build lacks ncurses, or the terminal is unknown.
[[nodiscard]] std::unique_ptr<SessionFace> make_terminal_face(const std::string& title);

/// Runs a session until it is over: samples from the feed, commands from the faces.
///
/// A recording may end before the session. The faces then decide; without a person the session
/// finishes with the readings so far. If standard input is closed, an open question ends the
/// session after some seconds: a review is finished, other phases can be resumed.
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
