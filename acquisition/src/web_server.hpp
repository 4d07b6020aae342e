// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "acquisition/src/web_certificate.hpp"
#include "acquisition/src/web_page.hpp"

namespace axiscal {

/// The address and the ports to listen on.
struct WebListening {
  std::string address;  ///< without brackets
  int first_port = 0;
  int ports_tried = 1;
  const WebCertificate* certificate = nullptr;  ///< the certificate for TLS; null: plain HTTP
};

/// Serves a page: HTTP/1.1 by Boost.Beast, in its own thread.
///
/// A request must be complete within five seconds, including the TLS handshake. web_request.hpp
/// limits the sizes of head and body. One network may have at most 32 connections. All networks
/// together may have at most 512. If a new client exceeds the first limit, the server closes the
/// oldest connection of the client's network. If the client exceeds the second limit, the server
/// closes the oldest connection of the network with the most connections. The server does not
/// disconnect watching browsers. A new client is therefore answered even if other clients keep many
/// connections open.
class WebServer {
 public:
  /// Listens on a port. Requests are answered only after start().
  /// @throws OutputError  if the server cannot listen on any of the ports.
  explicit WebServer(const WebListening& listening);

  /// Sends the last data to the watching browsers, for half a second at most, and ends.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  [[nodiscard]] int port() const;

  /// Starts to answer requests.
  /// @param page  must outlive the server.
  void start(WebPage& page);

  /// Sends new data of the page to the watching browsers. May be called from any thread.
  void publish();

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
};

}  // namespace axiscal
