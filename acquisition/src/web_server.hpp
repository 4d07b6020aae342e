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
  const WebCertificate* certificate = nullptr;  ///< TLS with it; null: plain HTTP
};

/// Serves a page: HTTP/1.1 by Boost.Beast, in one thread of its own that nobody waits for.
///
/// A request must be there whole, TLS's greeting included, within five seconds; its head and body
/// have limits (web_request.hpp). A network address has 32 connections, all together 512: where one
/// more comes, the oldest of that address, or of the address that has most, gives way to it, unless
/// it is a browser that watches. So whoever comes anew is answered, however many others hold on.
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
