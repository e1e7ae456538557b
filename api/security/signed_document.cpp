#include "api/security/signed_document.hpp"

#include <fmt/format.h>
#include <openssl/x509_vfy.h>

namespace plchost::security {

namespace {

using Message = std::unique_ptr<PKCS7, OpensslFree<PKCS7_free>>;
using Store = std::unique_ptr<X509_STORE, OpensslFree<X509_STORE_free>>;

}  // namespace

Result<std::string> sign_document(std::string_view text, const Authority& authority) {
  constexpr int kFlags = PKCS7_DETACHED | PKCS7_TEXT;
  const Bio in = reading_bio(text);
  const Bio out = writing_bio();
  const Message message(
      PKCS7_sign(authority.certificate.get(), authority.key.get(), nullptr, in.get(), kFlags));
  // The document that was read for the signature is read again for the message.
  const Bio again = reading_bio(text);
  if (!message || SMIME_write_PKCS7(out.get(), message.get(), again.get(), kFlags) != 1) {
    return openssl_failure("cannot sign a document");
  }
  return text_of(out);
}

Result<std::string> open_document(std::string_view what, std::string_view document,
                                  const Certificate& authority) {
  const Bio in = reading_bio(document);
  BIO* content = nullptr;
  const Message message(SMIME_read_PKCS7(in.get(), &content));
  const Bio owned(content);
  if (!message) return openssl_failure(fmt::format("{} is no signed document", what), ErrorCode::corrupt);
  const Store store(X509_STORE_new());
  const Bio out = writing_bio();
  if (!store || X509_STORE_add_cert(store.get(), authority.get()) != 1) {
    return openssl_failure("cannot prepare the check of a signature");
  }
  if (PKCS7_verify(message.get(), nullptr, store.get(), content, out.get(), PKCS7_TEXT) != 1) {
    return openssl_failure(fmt::format("{} is not as the permissions authority signed it", what),
                           ErrorCode::refused);
  }
  return text_of(out);
}

}  // namespace plchost::security
