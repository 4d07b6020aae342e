// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "axiscal/acquisition/session_face.hpp"

namespace axiscal {

struct WebOptions {
  std::string title;    ///< name of the session; any text
  std::string address;  ///< address to listen on; empty: loopback only
  int port = 0;         ///< port to listen on; 0 selects 8712 or the next free port
  /// Called with the page's address when the page can be opened, and with a new address each time a
  /// one-time key was used. `fingerprint` is the SHA-256 of the certificate, as browsers show it;
  /// empty on loopback. May be called from another thread.
  std::function<void(const std::string& url, const std::string& fingerprint)> announce;
};

/// Makes a face that shows the session as a web page. A small server in this program delivers the
/// page to browsers.
///
/// Several browsers may watch, but only one controls: the first one, or the one that last took
/// control. A browser without the key from the address gets no data. On loopback the server uses
/// plain HTTP. At other addresses it always uses TLS with a certificate made for the session, and
/// each key is valid for one browser. The server rejects requests that are addressed to another
/// host, come from another site, or are too long or too slow. Requests and session do not wait for
/// each other.
/// @throws DomainError  if this build lacks the page, the server, or TLS for an address other than
///                      loopback.
/// @throws OutputError  if the server cannot listen on the address.
[[nodiscard]] std::unique_ptr<SessionFace> make_web_face(const WebOptions& options);

/// @return a text as a QR code for a terminal, drawn with half-block characters; empty if this
///         build lacks libqrencode.
[[nodiscard]] std::string qr_code(const std::string& text);

}  // namespace axiscal
