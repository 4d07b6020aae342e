// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace axiscal {

/// A certificate made for one session, which its own key signs.
struct WebCertificate {
  std::string certificate_pem;
  std::string key_pem;
  std::string fingerprint;  ///< SHA-256 of the certificate, AB:CD:..., as browsers show it
};

/// @return whether this build can make one.
[[nodiscard]] bool has_tls();

/// Makes a certificate (ECDSA on P-256, valid from an hour ago for a week).
///
/// @param names  host names and addresses that it is for; the first is its common name.
/// @throws DomainError  in a build without OpenSSL, or if OpenSSL fails.
[[nodiscard]] WebCertificate make_certificate(const std::vector<std::string>& names);

}  // namespace axiscal
