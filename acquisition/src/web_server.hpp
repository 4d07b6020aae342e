// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "acquisition/src/web_certificate.hpp"
#include "acquisition/src/web_page.hpp"

namespace axiscal {

/// Where to listen.
struct WebListening {
  std::string address;  ///< without brackets
  int first_port = 0;
  int ports_tried = 1;
  const WebCertificate* certificate = nullptr;  ///< the certificate for TLS; null: plain HTTP
};

/// Serves a page: HTTP/1.1 by Boost.Beast, in its own thread.
///
/// A request must be complete within five seconds, including the greeting of TLS. Head and body
/// have limits (web_request.hpp). A network address may have 32 connections, all together 512. If
/// one more arrives, the oldest connection of that address, or of the address with most
/// connections, is closed, unless it is a browser that watches. So a new client is answered even if
/// many others hold connections.
class WebServer {
 public:
  /// Takes a port. Nobody is answered yet.
  /// @throws OutputError  if no such port can be listened at.
  explicit WebServer(const WebListening& listening);

  /// Sends browsers that watch what is new to them, and ends; waits for it half a second at most.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  [[nodiscard]] int port() const;

  /// Begins to answer.
  /// @param page  must outlive the server.
  void start(WebPage& page);

  /// Tells the browsers that watch that something is new; may be called from any thread.
  void publish();

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
};

}  // namespace axiscal
