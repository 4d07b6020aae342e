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

  /// Displays the view and the events since the last call. It is called about twenty times a second
  /// and must not block.
  virtual void show(const SessionView& view, const std::vector<SessionEvent>& events) = 0;

  /// @return the commands since the last call. Must not block.
  virtual std::vector<SessionCommand> commands() = 0;

  /// Displays the result of a session. If a person uses this face, the function returns after the
  /// person has answered.
  /// @param files  the output files of the session.
  /// @return true if the person wants another session.
  [[nodiscard]] virtual bool conclude(const SessionView& /*view*/,
                                      const std::vector<SessionFile>& /*files*/) {
    return false;
  }

  /// @return true if the face can still receive commands.
  [[nodiscard]] virtual bool accepts_commands() const { return true; }
};

/// Makes a face for screen readers and scripts. It prints lines of text to standard output and
/// reads commands as words from standard input.
/// @param reads_commands  false if standard input delivers samples instead of commands.
[[nodiscard]] std::unique_ptr<SessionFace> make_plain_face(bool reads_commands);

/// Makes a face that prints events and views as JSON lines to standard output. It reads commands
/// like the face of make_plain_face().
[[nodiscard]] std::unique_ptr<SessionFace> make_json_face(bool reads_commands);

/// Makes a full-screen face for a terminal of 80 x 24 characters or more. It uses ncurses.
/// @param title  name of the session, displayed at the top.
/// @throws DomainError  if this build lacks ncurses, or the terminal is unknown.
[[nodiscard]] std::unique_ptr<SessionFace> make_terminal_face(const std::string& title);

/// Passes the samples of the feed and the commands of the faces to a session until it is over.
///
/// A recording may end before the session does. A person can then finish or stop the session.
/// Without a person, the session finishes with the readings so far. If no face can receive
/// commands, a session that waits for an answer ends after some seconds. If it waits in the review,
/// it accepts the result; in other phases it stops and can be resumed.
/// @param unattended  true if no person answers.
/// @param reviewed    called each time a review begins, so that the caller can store results before
///                    a person answers; may be empty.
/// @throws Error  any error of LiveSession::set_channels(), LiveSession::add(), SampleFeed::read().
void run_session(LiveSession& session,
                 SampleFeed& feed,
                 const std::vector<SessionFace*>& faces,
                 bool unattended,
                 const std::function<void()>& reviewed = {});

}  // namespace axiscal
