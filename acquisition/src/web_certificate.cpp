// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/web_certificate.hpp"

#include <array>
#include <memory>

#ifdef AXISCAL_OPENSSL
#include <arpa/inet.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#endif

#include "axiscal/core/error.hpp"

namespace axiscal {

#ifdef AXISCAL_OPENSSL
namespace {

[[noreturn]] void fail() {
  std::array<char, 256> why{};
  ERR_error_string_n(ERR_get_error(), why.data(), why.size());
  throw DomainError(std::string("a certificate cannot be created: ") + why.data());
}

void must(bool succeeded) {
  if (!succeeded) {
    fail();
  }
}

struct Free {
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(X509_EXTENSION* extension) const { X509_EXTENSION_free(extension); }
  void operator()(BIO* memory) const { BIO_free(memory); }
};

template <typename Object>
using Owned = std::unique_ptr<Object, Free>;

void add_extension(X509* certificate, int kind, const std::string& value) {
  X509V3_CTX context{};
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const Owned<X509_EXTENSION> extension(
      X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  must(extension && X509_add_ext(certificate, extension.get(), -1) == 1);
}

bool is_address(const std::string& name) {
  in6_addr parsed{};
  return ::inet_pton(AF_INET, name.c_str(), &parsed) == 1 ||
         ::inet_pton(AF_INET6, name.c_str(), &parsed) == 1;
}

template <typename Write>
std::string pem_of(const Write& write) {
  const Owned<BIO> memory(BIO_new(BIO_s_mem()));
  must(memory && write(memory.get()) == 1);
  char* text = nullptr;
  const long size = BIO_get_mem_data(memory.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

std::string fingerprint_of(const X509* certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  must(X509_digest(certificate, EVP_sha256(), digest.data(), &size) == 1);
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string text;
  for (unsigned i = 0; i < size; ++i) {
    text += i == 0 ? "" : ":";
    text += digits[digest[i] >> 4U];
    text += digits[digest[i] & 15U];
  }
  return text;
}

}  // namespace

bool has_tls() {
  return true;
}

WebCertificate make_certificate(const std::vector<std::string>& names) {
  const Owned<EVP_PKEY> key(EVP_EC_gen("P-256"));
  const Owned<X509> certificate(X509_new());
  must(key && certificate);
  must(X509_set_version(certificate.get(), 2) == 1);
  std::array<unsigned char, 16> serial{};
  must(RAND_bytes(serial.data(), static_cast<int>(serial.size())) == 1);
  serial[0] &= 0x7FU;  // makes the number positive
  const std::unique_ptr<BIGNUM, void (*)(BIGNUM*)> number(
      BN_bin2bn(serial.data(), static_cast<int>(serial.size()), nullptr), BN_free);
  must(number && BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate.get())));
  constexpr long hour_s = 3600;
  constexpr long week_s = 7 * 24 * hour_s;
  must(X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -hour_s) != nullptr);
  must(X509_gmtime_adj(X509_getm_notAfter(certificate.get()), week_s) != nullptr);
  must(X509_set_pubkey(certificate.get(), key.get()) == 1);
  constexpr std::size_t longest_name = 64;  // X.509's limit on a common name
  const std::string name = names.front().substr(0, longest_name);
  X509_NAME* const subject = X509_get_subject_name(certificate.get());
  must(X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8,
                                  reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1,
                                  0) == 1);
  must(X509_set_issuer_name(certificate.get(), subject) == 1);
  std::string alternatives;
  for (const std::string& one : names) {
    alternatives += alternatives.empty() ? "" : ",";
    alternatives += (is_address(one) ? "IP:" : "DNS:") + one;
  }
  add_extension(certificate.get(), NID_subject_alt_name, alternatives);
  add_extension(certificate.get(), NID_basic_constraints, "critical,CA:FALSE");
  add_extension(certificate.get(), NID_ext_key_usage, "serverAuth");
  must(X509_sign(certificate.get(), key.get(), EVP_sha256()) > 0);
  return {
      .certificate_pem = pem_of([&](BIO* to) { return PEM_write_bio_X509(to, certificate.get()); }),
      .key_pem = pem_of([&](BIO* to) {
        return PEM_write_bio_PrivateKey(to, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
      }),
      .fingerprint = fingerprint_of(certificate.get())};
}

#else

bool has_tls() {
  return false;
}

WebCertificate make_certificate(const std::vector<std::string>& /*names*/) {
  throw DomainError("this build lacks TLS (OpenSSL)");
}

#endif

}  // namespace axiscal
