// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/src/web_request.hpp"
#include "axiscal/acquisition/session.hpp"

namespace axiscal {

/// The address and the title of a page.
struct WebPlace {
  std::string title;    ///< name of the session
  std::string scheme;   ///< "http" or "https"
  std::string address;  ///< address to listen on, without brackets
  int port = 0;
  bool is_loopback = true;  ///< true if only this machine can connect
  /// Receives the page's address, which includes the key. It is called when the page can be opened,
  /// and each time a one-time key was used. May be called from another thread.
  std::function<void(const std::string& url)> announce;
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
};

/// The session's page without the network: it answers requests, passes control between browsers and
/// collects events.
///
/// The functions may be called from several threads. A call waits only while another call runs.
class WebPage {
 public:
  explicit WebPage(WebPlace place);

  /// Calls WebPlace::announce with the address of the page.
  void announce() const;

  /// Returns the answer to a request. Requests for another host, from another site or without the
  /// key are rejected.
  [[nodiscard]] WebAnswer answer(const WebRequest& request);

  /// The newest data that a watching browser has received.
  struct Watcher {
    std::string session;
    std::size_t event = 0;
    std::size_t version = 0;
    std::size_t points = 0;  ///< number of points of a FreeSession
    std::size_t dropped = 0;
  };

  /// @return a watcher for an answer that is a stream.
  [[nodiscard]] Watcher watcher_for(const WebAnswer& answer) const;

  /// @return the next message of the event stream to a browser; empty without new data.
  [[nodiscard]] std::string news_for(Watcher& watcher) const;

  /// Stores a view of the session and its events, to be sent to all browsers.
  void show(const SessionView& view, const std::vector<SessionEvent>& events);

  /// Must be called when a browser begins to watch, and when it stops.
  void came(const Watcher& watcher);
  void gone(const Watcher& watcher);

  /// @return true if a browser is watching.
  [[nodiscard]] bool is_watched() const;

  /// Offers files for download at the end of a session. An empty list begins a new session.
  void offer(std::vector<SessionFile> files);

  /// @return the choice of the controlling browser after the end: "again" or "leave"; empty before
  ///         the choice.
  [[nodiscard]] std::string wish() const;

  /// @return the commands of the controlling browser since the last call.
  [[nodiscard]] std::vector<SessionCommand> commands();

 private:
  [[nodiscard]] std::string url() const;
  [[nodiscard]] std::optional<WebAnswer> early_refusal(const WebRequest& request) const;
  [[nodiscard]] std::string cookie_name() const;
  [[nodiscard]] std::string session_of(const WebRequest& request) const;
  [[nodiscard]] std::optional<WebAnswer> refused_control(const WebRequest& request) const;
  [[nodiscard]] WebAnswer login(const WebRequest& request);
  [[nodiscard]] WebAnswer take_control(const WebRequest& request);
  [[nodiscard]] WebAnswer take_command(const WebRequest& request);
  [[nodiscard]] WebAnswer take_wish(const WebRequest& request);
  [[nodiscard]] WebAnswer handle_heartbeat(const WebRequest& request);
  [[nodiscard]] WebAnswer stream(const WebRequest& request) const;
  [[nodiscard]] WebAnswer file(const WebRequest& request, const std::string& name) const;
  void lend_control();
  void take_points(const FreeView* free);

  WebPlace place_;
  mutable std::mutex mutex_;
  std::string key_;
  std::deque<std::string> sessions_;
  std::string owner_;       // session that last took or used control; initially the first session
  std::string controller_;  // session that has control; owner_, unless the owner is silent
  std::string view_ = "null";
  std::vector<std::string> points_;  // points of a FreeSession, as "x,y,z"
  std::size_t dropped_ = 0;
  std::size_t version_ = 1;
  std::deque<std::pair<std::size_t, std::string>> events_;
  std::size_t last_event_ = 0;
  std::vector<SessionCommand> commands_;
  std::vector<std::string> watching_;            // sessions of all pages that watch, oldest first
  std::chrono::steady_clock::time_point heard_;  // time of the controlling browser's last request
  std::vector<SessionFile> files_;
  std::string wish_;
};

/// @return an address without the brackets of IPv6, in the form that browsers use: ::1 instead of
///         0:0:0:0:0:0:0:1.
[[nodiscard]] std::string bare_address(const std::string& address);

/// @return the name of this machine.
[[nodiscard]] std::string host_name();

/// @return true if an address stands for all addresses of this machine, as 0.0.0.0.
[[nodiscard]] bool is_any_address(const std::string& address);

}  // namespace axiscal
