#include "api/security/pem.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/pem.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"

namespace plchost::security {

namespace {

// Without it libcrypto would ask on the terminal.
int no_password(char* /*buffer*/, int /*size*/, int /*writes*/, void* /*context*/) {
  return -1;
}

template <class Owner, class Read>
Result<Owner> read_pem(const std::string& path, std::string_view what, Read read) {
  PLCHOST_TRY_ASSIGN(const auto text, read_file(path));
  const Bio bio = reading_bio(text);
  Owner made(read(bio.get(), nullptr, no_password, nullptr));
  if (!made) return openssl_failure(fmt::format("{} is no {} in PEM form", path, what), ErrorCode::corrupt);
  return made;
}

template <class Write>
Result<std::string> write_pem(std::string_view what, Write write) {
  const Bio bio = writing_bio();
  if (write(bio.get()) != 1) return openssl_failure(fmt::format("cannot write a {}", what));
  return text_of(bio);
}

}  // namespace

// Something that is no file, as a FIFO, could make the reader wait for ever.
Result<std::string> read_file(const std::string& path) {
  const UniqueFd file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  if (!file) {
    const int reason = errno;
    return failure(reason == ENOENT ? ErrorCode::not_found : ErrorCode::system, "cannot read " + path,
                   reason);
  }
  struct stat status{};
  if (::fstat(file.get(), &status) != 0) return failure(ErrorCode::system, "cannot read " + path, errno);
  if (!S_ISREG(status.st_mode)) return failure(ErrorCode::corrupt, path + " is no regular file");
  std::string text(kMaxSecurityFile + 1, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t count = ::read(file.get(), text.data() + size, text.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return failure(ErrorCode::system, "cannot read " + path, errno);
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  text.resize(size);
  if (text.size() > kMaxSecurityFile) {
    return failure(ErrorCode::corrupt, fmt::format("{} is larger than {} bytes", path, kMaxSecurityFile));
  }
  return text;
}

Result<Certificate> read_certificate(const std::string& path) {
  return read_pem<Certificate>(path, "certificate", PEM_read_bio_X509);
}

Result<Key> read_key(const std::string& path) {
  return read_pem<Key>(path, "private key without a password", PEM_read_bio_PrivateKey);
}

Result<RevocationList> read_revocations(const std::string& path) {
  return read_pem<RevocationList>(path, "list of revoked certificates", PEM_read_bio_X509_CRL);
}

Result<std::string> to_pem(const Certificate& certificate) {
  return write_pem("certificate", [&](BIO* bio) { return PEM_write_bio_X509(bio, certificate.get()); });
}

Result<std::string> to_pem(const RevocationList& revocations) {
  return write_pem("revocation list",
                   [&](BIO* bio) { return PEM_write_bio_X509_CRL(bio, revocations.get()); });
}

Result<std::string> to_pem(const Key& key) {
  return write_pem("private key", [&](BIO* bio) {
    return PEM_write_bio_PKCS8PrivateKey(bio, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  });
}

}  // namespace plchost::security
