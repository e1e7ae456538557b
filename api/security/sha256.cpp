#include "api/security/sha256.hpp"

#include <array>
#include <cassert>
#include <new>

#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/sha.h>

namespace plchost {

std::string sha256(std::string_view text) {
  Sha256 hash;
  hash.add(std::as_bytes(std::span(text)));
  return hash.digest();
}

struct Sha256::Context {
  EVP_MD_CTX* raw = EVP_MD_CTX_new();
};

// Only memory can fail in here.
Sha256::Sha256() : context_(std::make_unique<Context>()) {
  if (context_->raw == nullptr || EVP_DigestInit_ex(context_->raw, EVP_sha256(), nullptr) != 1) {
    throw std::bad_alloc();
  }
}

Sha256::~Sha256() {
  EVP_MD_CTX_free(context_->raw);
}

void Sha256::add(std::span<const std::byte> bytes) {
  if (EVP_DigestUpdate(context_->raw, bytes.data(), bytes.size()) != 1) throw std::bad_alloc();
}

std::string Sha256::digest() {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  if (EVP_DigestFinal_ex(context_->raw, digest.data(), nullptr) != 1) throw std::bad_alloc();
  return fmt::format("{:02x}", fmt::join(digest, ""));
}

}  // namespace plchost
