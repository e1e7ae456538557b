// Lists of revoked certificates, and the check of a certificate against them: see certificates.hpp.
#include <algorithm>

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>

#include "api/security/certificates.hpp"

namespace plchost::security {

namespace {

using Integer = std::unique_ptr<ASN1_INTEGER, OpensslFree<ASN1_INTEGER_free>>;
using Time = std::unique_ptr<ASN1_TIME, OpensslFree<ASN1_TIME_free>>;
using Revoked = std::unique_ptr<X509_REVOKED, OpensslFree<X509_REVOKED_free>>;
using Store = std::unique_ptr<X509_STORE, OpensslFree<X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, OpensslFree<X509_STORE_CTX_free>>;

bool copy_entries(X509_CRL* from, X509_CRL* to) {
  const STACK_OF(X509_REVOKED)* const entries = X509_CRL_get_REVOKED(from);
  for (int i = 0; i < sk_X509_REVOKED_num(entries); ++i) {
    Revoked copy(X509_REVOKED_dup(sk_X509_REVOKED_value(entries, i)));
    if (!copy || X509_CRL_add0_revoked(to, copy.get()) != 1) return false;
    (void)copy.release();
  }
  return true;
}

bool add_entry(X509_CRL* to, const X509* certificate, std::time_t now) {
  const Time since(ASN1_TIME_set(nullptr, now));
  Revoked entry(X509_REVOKED_new());
  if (!since || !entry ||
      X509_REVOKED_set_serialNumber(entry.get(),
                                    const_cast<ASN1_INTEGER*>(X509_get0_serialNumber(certificate))) != 1 ||
      X509_REVOKED_set_revocationDate(entry.get(), since.get()) != 1 ||
      X509_CRL_add0_revoked(to, entry.get()) != 1) {
    return false;
  }
  (void)entry.release();
  return true;
}

// Those that it has already stay as they are.
bool add_entries(X509_CRL* to, std::span<const Certificate> certificates, std::time_t now) {
  return std::ranges::all_of(certificates, [&](const Certificate& certificate) {
    X509_REVOKED* known = nullptr;
    return X509_CRL_get0_by_serial(to, &known, X509_get_serialNumber(certificate.get())) != 0 ||
           add_entry(to, certificate.get(), now);
  });
}

// Each list has a higher number than the one before.
bool add_number(X509_CRL* to, X509_CRL* before) {
  long number = 1;
  if (before != nullptr) {
    const Integer known(
        static_cast<ASN1_INTEGER*>(X509_CRL_get_ext_d2i(before, NID_crl_number, nullptr, nullptr)));
    if (known) number = ASN1_INTEGER_get(known.get()) + 1;
  }
  const Integer made(ASN1_INTEGER_new());
  return made && ASN1_INTEGER_set(made.get(), number) == 1 &&
         X509_CRL_add1_ext_i2d(to, NID_crl_number, made.get(), 0, 0) == 1;
}

bool set_times(X509_CRL* list, const Validity& validity) {
  const Time now(ASN1_TIME_set(nullptr, validity.not_before));
  const Time next(ASN1_TIME_set(nullptr, validity.not_after));
  return now && next && X509_CRL_set1_lastUpdate(list, now.get()) == 1 &&
         X509_CRL_set1_nextUpdate(list, next.get()) == 1;
}

}  // namespace

Result<RevocationList> make_revocations(const RevocationList& known, std::span<const Certificate> added,
                                        const Validity& validity, const Authority& authority) {
  RevocationList made(X509_CRL_new());
  constexpr long kVersion2 = 1;
  if (!made || X509_CRL_set_version(made.get(), kVersion2) != 1 ||
      X509_CRL_set_issuer_name(made.get(), X509_get_subject_name(authority.certificate.get())) != 1 ||
      !set_times(made.get(), validity) || (known && !copy_entries(known.get(), made.get())) ||
      !add_entries(made.get(), added, std::time(nullptr)) || !add_number(made.get(), known.get()) ||
      X509_CRL_sort(made.get()) != 1 || X509_CRL_sign(made.get(), authority.key.get(), EVP_sha256()) == 0) {
    return openssl_failure("cannot create the list of revoked certificates");
  }
  return made;
}

bool is_revoked(const Certificate& certificate, const RevocationList& revocations) {
  X509_REVOKED* entry = nullptr;
  return X509_CRL_get0_by_cert(revocations.get(), &entry, certificate.get()) != 0;
}

Result<void> verify_certificate(const Certificate& certificate, const Certificate& authority,
                                const RevocationList& revocations) {
  const Store store(X509_STORE_new());
  const StoreContext context(X509_STORE_CTX_new());
  if (!store || !context || X509_STORE_add_cert(store.get(), authority.get()) != 1 ||
      (revocations && X509_STORE_add_crl(store.get(), revocations.get()) != 1) ||
      X509_STORE_CTX_init(context.get(), store.get(), certificate.get(), nullptr) != 1) {
    return openssl_failure("cannot prepare the check of a certificate");
  }
  if (revocations) X509_STORE_CTX_set_flags(context.get(), X509_V_FLAG_CRL_CHECK);
  if (X509_verify_cert(context.get()) == 1) return {};
  const int reason = X509_STORE_CTX_get_error(context.get());
  ERR_clear_error();
  return failure(ErrorCode::refused,
                 fmt::format("the certificate of '{}' is not accepted: {}",
                             subject_text(certificate).value_or(""), X509_verify_cert_error_string(reason)));
}

Result<void> verify_revocations(const RevocationList& revocations, const Certificate& authority) {
  if (X509_CRL_verify(revocations.get(), X509_get0_pubkey(authority.get())) == 1) return {};
  return openssl_failure("the list of revoked certificates is not signed by the identity authority",
                         ErrorCode::corrupt);
}

}  // namespace plchost::security
