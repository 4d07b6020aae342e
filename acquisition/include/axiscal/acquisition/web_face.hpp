// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "axiscal/acquisition/session_face.hpp"

namespace axiscal {

struct WebOptions {
  std::string title;    ///< name of the session; any text
  std::string address;  ///< to listen at; empty: loopback only
  int port = 0;         ///< 0: 8712 or the next free one
  /// Called with the page's address when it can be opened, and with a new one when a one-time key
  /// was used; and with the SHA-256 of the certificate that browsers will show, empty on loopback.
  /// May be called from another thread.
  std::function<void(const std::string& url, const std::string& fingerprint)> announce;
};

/// The session as a page in browsers: a small server in this program.
///
/// Several may watch, one controls: the first, or who takes it over. Who has not the key from the
/// address sees nothing. On loopback it is plain HTTP; at other addresses always TLS, with a
/// certificate made for the session, and a key opens one browser only. Requests for another host,
/// from another site, too long or too slow are turned away, and no request ever waits for the
/// session or the session for it.
/// @throws DomainError  if this build lacks the page, the server, or TLS for an address other than
///                      loopback.
/// @throws OutputError  if the address cannot be listened at.
[[nodiscard]] std::unique_ptr<SessionFace> make_web_face(const WebOptions& options);

/// @return a text as a QR code for a terminal, in half blocks; empty if this build lacks
///         libqrencode.
[[nodiscard]] std::string qr_code(const std::string& text);

}  // namespace axiscal
