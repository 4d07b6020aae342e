// SPDX-License-Identifier: Apache-2.0
// OpenSSL as Boost.Asio calls it, loaded by the first connection that is to be encrypted. Asio
// names the functions with :: before them, so that only another name can take their place.
#pragma once

#include <openssl/bio.h>
#include <openssl/conf.h>
#include <openssl/dh.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/rsa.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include "core/late_library.hpp"

#if defined(AXISCAL_OPENSSL_LATE) && defined(AXISCAL_CRYPTO_LATE)
#define AXISCAL_LATE_GLOBAL(LIBRARY, FUNCTION)                                \
  [[maybe_unused]] static const ::axiscal::LateFunction<decltype(::FUNCTION)> \
      axiscal_late_##FUNCTION{LIBRARY, #FUNCTION};

// Some are old, and Asio names them all the same.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
AXISCAL_LATE_LIBRARY(axiscal_libssl, AXISCAL_OPENSSL)
AXISCAL_LATE_LIBRARY(axiscal_libcrypto, AXISCAL_CRYPTO)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_clear_options)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_ctrl)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_free)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_get_cert_store)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_get_default_passwd_cb)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_get_default_passwd_cb_userdata)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_get_ex_data)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_get_verify_callback)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_get_verify_mode)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_load_verify_locations)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_new)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_set_default_passwd_cb_userdata)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_set_default_verify_paths)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_set_ex_data)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_set_options)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_set_verify)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_set_verify_depth)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_use_PrivateKey)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_use_PrivateKey_file)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_use_RSAPrivateKey)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_use_RSAPrivateKey_file)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_use_certificate)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_use_certificate_ASN1)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_use_certificate_chain_file)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_CTX_use_certificate_file)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_accept)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_connect)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_ctrl)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_free)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_get_SSL_CTX)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_get_error)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_get_ex_data)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_get_ex_data_X509_STORE_CTX_idx)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_get_shutdown)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_get_verify_callback)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_get_verify_mode)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_new)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_read)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_set_bio)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_set_ex_data)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_set_verify)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_set_verify_depth)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_shutdown)
AXISCAL_LATE_GLOBAL(axiscal_libssl, SSL_write)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLS_client_method)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLS_method)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLS_server_method)
#if !defined(OPENSSL_NO_TLS1_1_METHOD)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLSv1_1_client_method)
#endif
#if !defined(OPENSSL_NO_TLS1_1_METHOD)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLSv1_1_method)
#endif
#if !defined(OPENSSL_NO_TLS1_1_METHOD)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLSv1_1_server_method)
#endif
#if !defined(OPENSSL_NO_TLS1_2_METHOD)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLSv1_2_client_method)
#endif
#if !defined(OPENSSL_NO_TLS1_2_METHOD)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLSv1_2_method)
#endif
#if !defined(OPENSSL_NO_TLS1_2_METHOD)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLSv1_2_server_method)
#endif
#if !defined(OPENSSL_NO_TLS1_METHOD)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLSv1_client_method)
#endif
#if !defined(OPENSSL_NO_TLS1_METHOD)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLSv1_method)
#endif
#if !defined(OPENSSL_NO_TLS1_METHOD)
AXISCAL_LATE_GLOBAL(axiscal_libssl, TLSv1_server_method)
#endif
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, BIO_ctrl)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, BIO_ctrl_pending)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, BIO_free)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, BIO_new_bio_pair)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, BIO_new_file)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, BIO_new_mem_buf)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, BIO_read)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, BIO_write)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, DH_free)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, ERR_clear_error)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, ERR_get_error)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, ERR_lib_error_string)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, ERR_peek_error)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, ERR_peek_last_error)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, ERR_reason_error_string)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, EVP_PKEY_free)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, PEM_read_bio_DHparams)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, PEM_read_bio_PrivateKey)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, PEM_read_bio_RSAPrivateKey)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, PEM_read_bio_X509)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, PEM_read_bio_X509_AUX)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, RSA_free)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, X509_STORE_CTX_get_ex_data)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, X509_STORE_add_cert)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, X509_free)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, d2i_PrivateKey_bio)
AXISCAL_LATE_GLOBAL(axiscal_libcrypto, d2i_RSAPrivateKey_bio)
#pragma GCC diagnostic pop

// Older ones of Asio call it as a program ends, which is no time to load a library.
[[maybe_unused]] static inline void axiscal_late_CONF_modules_unload(int /*all*/) {}

#define SSL_CTX_clear_options axiscal_late_SSL_CTX_clear_options
#define SSL_CTX_ctrl axiscal_late_SSL_CTX_ctrl
#define SSL_CTX_free axiscal_late_SSL_CTX_free
#define SSL_CTX_get_cert_store axiscal_late_SSL_CTX_get_cert_store
#define SSL_CTX_get_default_passwd_cb axiscal_late_SSL_CTX_get_default_passwd_cb
#define SSL_CTX_get_default_passwd_cb_userdata axiscal_late_SSL_CTX_get_default_passwd_cb_userdata
#define SSL_CTX_get_ex_data axiscal_late_SSL_CTX_get_ex_data
#define SSL_CTX_get_verify_callback axiscal_late_SSL_CTX_get_verify_callback
#define SSL_CTX_get_verify_mode axiscal_late_SSL_CTX_get_verify_mode
#define SSL_CTX_load_verify_locations axiscal_late_SSL_CTX_load_verify_locations
#define SSL_CTX_new axiscal_late_SSL_CTX_new
#define SSL_CTX_set_default_passwd_cb_userdata axiscal_late_SSL_CTX_set_default_passwd_cb_userdata
#define SSL_CTX_set_default_verify_paths axiscal_late_SSL_CTX_set_default_verify_paths
#define SSL_CTX_set_ex_data axiscal_late_SSL_CTX_set_ex_data
#define SSL_CTX_set_options axiscal_late_SSL_CTX_set_options
#define SSL_CTX_set_verify axiscal_late_SSL_CTX_set_verify
#define SSL_CTX_set_verify_depth axiscal_late_SSL_CTX_set_verify_depth
#define SSL_CTX_use_PrivateKey axiscal_late_SSL_CTX_use_PrivateKey
#define SSL_CTX_use_PrivateKey_file axiscal_late_SSL_CTX_use_PrivateKey_file
#define SSL_CTX_use_RSAPrivateKey axiscal_late_SSL_CTX_use_RSAPrivateKey
#define SSL_CTX_use_RSAPrivateKey_file axiscal_late_SSL_CTX_use_RSAPrivateKey_file
#define SSL_CTX_use_certificate axiscal_late_SSL_CTX_use_certificate
#define SSL_CTX_use_certificate_ASN1 axiscal_late_SSL_CTX_use_certificate_ASN1
#define SSL_CTX_use_certificate_chain_file axiscal_late_SSL_CTX_use_certificate_chain_file
#define SSL_CTX_use_certificate_file axiscal_late_SSL_CTX_use_certificate_file
#define SSL_accept axiscal_late_SSL_accept
#define SSL_connect axiscal_late_SSL_connect
#define SSL_ctrl axiscal_late_SSL_ctrl
#define SSL_free axiscal_late_SSL_free
#define SSL_get_SSL_CTX axiscal_late_SSL_get_SSL_CTX
#define SSL_get_error axiscal_late_SSL_get_error
#define SSL_get_ex_data axiscal_late_SSL_get_ex_data
#define SSL_get_ex_data_X509_STORE_CTX_idx axiscal_late_SSL_get_ex_data_X509_STORE_CTX_idx
#define SSL_get_shutdown axiscal_late_SSL_get_shutdown
#define SSL_get_verify_callback axiscal_late_SSL_get_verify_callback
#define SSL_get_verify_mode axiscal_late_SSL_get_verify_mode
#define SSL_new axiscal_late_SSL_new
#define SSL_read axiscal_late_SSL_read
#define SSL_set_bio axiscal_late_SSL_set_bio
#define SSL_set_ex_data axiscal_late_SSL_set_ex_data
#define SSL_set_verify axiscal_late_SSL_set_verify
#define SSL_set_verify_depth axiscal_late_SSL_set_verify_depth
#define SSL_shutdown axiscal_late_SSL_shutdown
#define SSL_write axiscal_late_SSL_write
#define TLS_client_method axiscal_late_TLS_client_method
#define TLS_method axiscal_late_TLS_method
#define TLS_server_method axiscal_late_TLS_server_method
#if !defined(OPENSSL_NO_TLS1_1_METHOD)
#define TLSv1_1_client_method axiscal_late_TLSv1_1_client_method
#endif
#if !defined(OPENSSL_NO_TLS1_1_METHOD)
#define TLSv1_1_method axiscal_late_TLSv1_1_method
#endif
#if !defined(OPENSSL_NO_TLS1_1_METHOD)
#define TLSv1_1_server_method axiscal_late_TLSv1_1_server_method
#endif
#if !defined(OPENSSL_NO_TLS1_2_METHOD)
#define TLSv1_2_client_method axiscal_late_TLSv1_2_client_method
#endif
#if !defined(OPENSSL_NO_TLS1_2_METHOD)
#define TLSv1_2_method axiscal_late_TLSv1_2_method
#endif
#if !defined(OPENSSL_NO_TLS1_2_METHOD)
#define TLSv1_2_server_method axiscal_late_TLSv1_2_server_method
#endif
#if !defined(OPENSSL_NO_TLS1_METHOD)
#define TLSv1_client_method axiscal_late_TLSv1_client_method
#endif
#if !defined(OPENSSL_NO_TLS1_METHOD)
#define TLSv1_method axiscal_late_TLSv1_method
#endif
#if !defined(OPENSSL_NO_TLS1_METHOD)
#define TLSv1_server_method axiscal_late_TLSv1_server_method
#endif
#define BIO_ctrl axiscal_late_BIO_ctrl
#define BIO_ctrl_pending axiscal_late_BIO_ctrl_pending
#define BIO_free axiscal_late_BIO_free
#define BIO_new_bio_pair axiscal_late_BIO_new_bio_pair
#define BIO_new_file axiscal_late_BIO_new_file
#define BIO_new_mem_buf axiscal_late_BIO_new_mem_buf
#define BIO_read axiscal_late_BIO_read
#define BIO_write axiscal_late_BIO_write
#define CONF_modules_unload axiscal_late_CONF_modules_unload
#define DH_free axiscal_late_DH_free
#define ERR_clear_error axiscal_late_ERR_clear_error
#define ERR_get_error axiscal_late_ERR_get_error
#define ERR_lib_error_string axiscal_late_ERR_lib_error_string
#define ERR_peek_error axiscal_late_ERR_peek_error
#define ERR_peek_last_error axiscal_late_ERR_peek_last_error
#define ERR_reason_error_string axiscal_late_ERR_reason_error_string
#define EVP_PKEY_free axiscal_late_EVP_PKEY_free
#define PEM_read_bio_DHparams axiscal_late_PEM_read_bio_DHparams
#define PEM_read_bio_PrivateKey axiscal_late_PEM_read_bio_PrivateKey
#define PEM_read_bio_RSAPrivateKey axiscal_late_PEM_read_bio_RSAPrivateKey
#define PEM_read_bio_X509 axiscal_late_PEM_read_bio_X509
#define PEM_read_bio_X509_AUX axiscal_late_PEM_read_bio_X509_AUX
#define RSA_free axiscal_late_RSA_free
#define X509_STORE_CTX_get_ex_data axiscal_late_X509_STORE_CTX_get_ex_data
#define X509_STORE_add_cert axiscal_late_X509_STORE_add_cert
#define X509_free axiscal_late_X509_free
#define d2i_PrivateKey_bio axiscal_late_d2i_PrivateKey_bio
#define d2i_RSAPrivateKey_bio axiscal_late_d2i_RSAPrivateKey_bio
#endif
