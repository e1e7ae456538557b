#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>

#include "shm/base/result.hpp"

namespace plchost::security {

/// Frees what libcrypto made with libcrypto's own function for it.
template <auto Free>
struct OpensslFree {
  template <class T>
  void operator()(T* made) const noexcept {
    Free(made);
  }
};

using Key = std::unique_ptr<EVP_PKEY, OpensslFree<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, OpensslFree<X509_free>>;
using RevocationList = std::unique_ptr<X509_CRL, OpensslFree<X509_CRL_free>>;
using Bio = std::unique_ptr<BIO, OpensslFree<BIO_free_all>>;

/// An error, with libcrypto's text about it. Empties this thread's list of libcrypto's errors.
[[nodiscard]] std::unexpected<Error> openssl_failure(std::string_view step,
                                                     ErrorCode code = ErrorCode::system);

/// Memory for libcrypto to read from (`text` must live as long) or to write to; never null.
[[nodiscard]] Bio reading_bio(std::string_view text);
[[nodiscard]] Bio writing_bio();
[[nodiscard]] std::string text_of(const Bio& bio);

}  // namespace plchost::security
