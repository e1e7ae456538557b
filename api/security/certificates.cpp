#include "api/security/certificates.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/rand.h>
#include <openssl/sha.h>
#include <openssl/x509v3.h>

#include "shm/base/names.hpp"

namespace plchost::security {

namespace {

using Name = std::unique_ptr<X509_NAME, OpensslFree<X509_NAME_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, OpensslFree<X509_EXTENSION_free>>;

constexpr std::string_view kOrganisation = "plchost";
/// The GUID prefixes of hosts begin with the bit that all have, and then as many zeros.
constexpr unsigned kHostZeroBits = 16;

bool add_entry(X509_NAME* name, int what, std::string_view text, int type = V_ASN1_UTF8STRING) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(text.data());
  return X509_NAME_add_entry_by_NID(name, what, type, bytes, static_cast<int>(text.size()), -1, 0) == 1;
}

Result<GuidPrefix> prefix_of(const X509_NAME* name) {
  unsigned char* der = nullptr;
  const int size = i2d_X509_NAME(name, &der);
  if (size <= 0) return openssl_failure("cannot read the subject of a certificate");
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(der, static_cast<std::size_t>(size), digest.data());
  OPENSSL_free(der);
  GuidPrefix prefix{};
  unsigned carried = 0x80;  // the bit that says: of a secured participant
  for (std::size_t i = 0; i < prefix.size(); ++i) {
    prefix[i] = static_cast<std::uint8_t>(carried | digest[i] >> 1U);
    carried = (digest[i] & 1U) << 7U;
  }
  return prefix;
}

bool is_lowest(const GuidPrefix& prefix) {
  static_assert(kHostZeroBits == 16);
  return prefix[0] == 0x80 && prefix[1] == 0 && prefix[2] < 0x80;
}

Result<Name> plain_name(const Subject& subject) {
  Name name(X509_NAME_new());
  if (!name || !add_entry(name.get(), NID_organizationName, kOrganisation) ||
      !add_entry(name.get(), NID_organizationalUnitName, to_string(subject.role)) ||
      !add_entry(name.get(), NID_commonName, subject.name)) {
    return openssl_failure(fmt::format("cannot create the subject '{}'", subject.name));
  }
  return name;
}

// Tries serial numbers until the hash falls as it must: for a host some 65,000.
Result<Name> make_name(const Subject& subject) {
  const bool wants_lowest = subject.role == Role::host;
  constexpr int kTries = 1 << 24;
  for (int number = 0; number < kTries; ++number) {
    PLCHOST_TRY_ASSIGN(auto name, plain_name(subject));
    // The first try of a client has none: its subject says what it must and no more.
    if ((wants_lowest || number > 0) &&
        !add_entry(name.get(), NID_serialNumber, std::to_string(number), V_ASN1_PRINTABLESTRING)) {
      return openssl_failure("cannot create a subject");
    }
    PLCHOST_TRY_ASSIGN(const auto prefix, prefix_of(name.get()));
    if (is_lowest(prefix) == wants_lowest) return name;
  }
  return failure(ErrorCode::system, fmt::format("no subject for '{}' has the hash it needs", subject.name));
}

bool set_random_serial(X509* certificate) {
  constexpr int kBits = 120;
  const std::unique_ptr<BIGNUM, OpensslFree<BN_free>> number(BN_new());
  return number && BN_rand(number.get(), kBits, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) == 1 &&
         BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)) != nullptr;
}

bool add_extension(X509* certificate, X509* issuer, int what, const char* value) {
  X509V3_CTX context{};
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, what, value));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

/// A certificate with all but its issuer, extensions and signature.
Result<Certificate> begin_certificate(const Name& subject, const Validity& validity, const Key& key) {
  Certificate made(X509_new());
  constexpr long kVersion3 = 2;
  if (!made || X509_set_version(made.get(), kVersion3) != 1 || !set_random_serial(made.get()) ||
      X509_set_subject_name(made.get(), subject.get()) != 1 || X509_set_pubkey(made.get(), key.get()) != 1 ||
      ASN1_TIME_set(X509_getm_notBefore(made.get()), validity.not_before) == nullptr ||
      ASN1_TIME_set(X509_getm_notAfter(made.get()), validity.not_after) == nullptr) {
    return openssl_failure("cannot create a certificate");
  }
  return made;
}

Result<std::time_t> unix_time(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1)
    return openssl_failure("cannot read a time of a certificate", ErrorCode::corrupt);
  return ::timegm(&parts);
}

/// The text of the only entry of that kind; empty: there is none, or several.
std::string entry_of(const X509_NAME* name, int what) {
  const int at = X509_NAME_get_index_by_NID(name, what, -1);
  if (at < 0 || X509_NAME_get_index_by_NID(name, what, at) >= 0) return "";
  const ASN1_STRING* const data = X509_NAME_ENTRY_get_data(X509_NAME_get_entry(name, at));
  return {reinterpret_cast<const char*>(ASN1_STRING_get0_data(data)),
          static_cast<std::size_t>(ASN1_STRING_length(data))};
}

}  // namespace

Result<Key> make_key() {
  Key key(EVP_PKEY_Q_keygen(nullptr, nullptr, "EC", "P-256"));
  if (!key) return openssl_failure("cannot create a private key");
  return key;
}

Result<Authority> make_authority(const std::string& name, const Validity& validity) {
  PLCHOST_TRY_ASSIGN(auto key, make_key());
  const Name subject(X509_NAME_new());
  if (!subject || !add_entry(subject.get(), NID_organizationName, kOrganisation) ||
      !add_entry(subject.get(), NID_commonName, name)) {
    return openssl_failure(fmt::format("cannot create the subject '{}'", name));
  }
  PLCHOST_TRY_ASSIGN(auto made, begin_certificate(subject, validity, key));
  X509* const raw = made.get();
  if (X509_set_issuer_name(raw, subject.get()) != 1 ||
      !add_extension(raw, raw, NID_basic_constraints, "critical,CA:TRUE") ||
      !add_extension(raw, raw, NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature") ||
      !add_extension(raw, raw, NID_subject_key_identifier, "hash") ||
      X509_sign(raw, key.get(), EVP_sha256()) == 0) {
    return openssl_failure(fmt::format("cannot create the authority '{}'", name));
  }
  return Authority{std::move(made), std::move(key)};
}

Result<Certificate> issue_certificate(const Subject& subject, const Validity& validity, const Key& key,
                                      const Authority& authority) {
  PLCHOST_TRY_ASSIGN(const auto name, make_name(subject));
  PLCHOST_TRY_ASSIGN(auto made, begin_certificate(name, validity, key));
  X509* const raw = made.get();
  X509* const issuer = authority.certificate.get();
  if (X509_set_issuer_name(raw, X509_get_subject_name(issuer)) != 1 ||
      !add_extension(raw, issuer, NID_basic_constraints, "critical,CA:FALSE") ||
      !add_extension(raw, issuer, NID_key_usage, "critical,digitalSignature") ||
      !add_extension(raw, issuer, NID_subject_key_identifier, "hash") ||
      !add_extension(raw, issuer, NID_authority_key_identifier, "keyid") ||
      X509_sign(raw, authority.key.get(), EVP_sha256()) == 0) {
    return openssl_failure(fmt::format("cannot create a certificate for '{}'", subject.name));
  }
  return made;
}

Result<Subject> subject_of(const Certificate& certificate) {
  const X509_NAME* const name = X509_get_subject_name(certificate.get());
  const auto role = parse_role(entry_of(name, NID_organizationalUnitName));
  Subject subject{.role = role.value_or(Role::viewer), .name = entry_of(name, NID_commonName)};
  if (role && entry_of(name, NID_organizationName) == kOrganisation &&
      check_name("identity", subject.name, kMaxIdentityName)) {
    return subject;
  }
  return failure(
      ErrorCode::corrupt,
      fmt::format("the certificate's subject '{}' is not of the form O=plchost, OU=<role>, CN=<name>",
                  shown(subject_text(certificate).value_or(""))));
}

Result<Validity> validity_of(const Certificate& certificate) {
  PLCHOST_TRY_ASSIGN(const auto not_before, unix_time(X509_get0_notBefore(certificate.get())));
  PLCHOST_TRY_ASSIGN(const auto not_after, unix_time(X509_get0_notAfter(certificate.get())));
  return Validity{not_before, not_after};
}

Result<std::string> subject_text(const Certificate& certificate) {
  const Bio bio = writing_bio();
  if (X509_NAME_print_ex(bio.get(), X509_get_subject_name(certificate.get()), 0,
                         XN_FLAG_RFC2253 & ~ASN1_STRFLGS_ESC_MSB) < 0) {
    return openssl_failure("cannot write the subject of a certificate");
  }
  return text_of(bio);
}

Result<std::string> serial_text(const Certificate& certificate) {
  const std::unique_ptr<BIGNUM, OpensslFree<BN_free>> number(
      ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate.get()), nullptr));
  char* const digits = number ? BN_bn2hex(number.get()) : nullptr;
  if (digits == nullptr) return openssl_failure("cannot read the serial number of a certificate");
  std::string text = digits;
  OPENSSL_free(digits);
  return text;
}

Result<GuidPrefix> guid_prefix(const Certificate& certificate) {
  return prefix_of(X509_get_subject_name(certificate.get()));
}

}  // namespace plchost::security
