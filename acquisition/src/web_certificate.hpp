// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace axiscal {

/// A self-signed certificate for one session.
struct WebCertificate {
  std::string certificate_pem;
  std::string key_pem;
  std::string fingerprint;  ///< SHA-256 of the certificate, AB:CD:..., as browsers show it
};

/// @return true if this build supports TLS.
[[nodiscard]] bool has_tls();

/// Makes a certificate (ECDSA on P-256, valid from one hour ago to one week from now).
///
/// @param names  host names and addresses of the server; the first one is the common name.
/// @throws DomainError  in a build without OpenSSL, or if OpenSSL fails.
[[nodiscard]] WebCertificate make_certificate(const std::vector<std::string>& names);

}  // namespace axiscal
