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

/// The address and the name of a page.
struct WebPlace {
  std::string title;    ///< name of the session
  std::string scheme;   ///< "http" or "https"
  std::string address;  ///< listened at, without brackets
  int port = 0;
  bool is_loopback = true;  ///< nobody but this machine
  /// Called with the page's address, key included: when it can be opened first, and when a one-time
  /// key was used. May be called from another thread.
  std::function<void(const std::string& url)> announce;
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
};

/// The session's page without the network: the answer to each request, the browser in control, new
/// events.
///
/// Its functions may be called from several threads; none waits for anything but the others.
class WebPage {
 public:
  explicit WebPage(WebPlace place);

  /// Says where the page is.
  void announce() const;

  /// The answer to a request. Requests for another host, from another site or without the key are
  /// rejected.
  [[nodiscard]] WebAnswer answer(const WebRequest& request);

  /// The last event that a watching browser has received.
  struct Watcher {
    std::string session;
    std::size_t event = 0;
    std::size_t version = 0;
    std::size_t points = 0;  ///< of a free session
    std::size_t dropped = 0;
  };

  /// @return a watcher for an answer that is a stream.
  [[nodiscard]] Watcher watcher_for(const WebAnswer& answer) const;

  /// @return the event stream's next message for a browser; empty without news.
  [[nodiscard]] std::string news_for(Watcher& watcher) const;

  /// Takes a view of the session and its events, for all browsers.
  void show(const SessionView& view, const std::vector<SessionEvent>& events);

  /// A browser that watches has come, or gone.
  void came(const Watcher& watcher);
  void gone(const Watcher& watcher);

  /// @return true if a browser is watching.
  [[nodiscard]] bool is_watched() const;

  /// Offers files at the end of a session; without files a new session starts.
  void offer(std::vector<SessionFile> files);

  /// @return the choice of the browser in control after the end: "again" or "leave"; empty: open.
  [[nodiscard]] std::string wish() const;

  /// @return the commands of the browser in control since the last call.
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
  std::string owner_;       // of control: it came first, took it, or used it last
  std::string controller_;  // another than the owner while that one is not heard
  std::string view_ = "null";
  std::vector<std::string> points_;  // of a free session, "x,y,z"
  std::size_t dropped_ = 0;
  std::size_t version_ = 1;
  std::deque<std::pair<std::size_t, std::string>> events_;
  std::size_t last_event_ = 0;
  std::vector<SessionCommand> commands_;
  std::vector<std::string> watching_;  // a browser's session for each of its pages, oldest first
  std::chrono::steady_clock::time_point heard_;  // of the browser that controls
  std::vector<SessionFile> files_;
  std::string wish_;
};

/// @return an address without the brackets of IPv6 and as browsers write it: ::1 for
/// 0:0:0:0:0:0:0:1.
[[nodiscard]] std::string bare_address(const std::string& address);

/// @return the name of this machine.
[[nodiscard]] std::string host_name();

/// @return true if an address means all addresses of this machine.
[[nodiscard]] bool is_any_address(const std::string& address);

}  // namespace axiscal
