#pragma once

#include <string>

#include "api/security/openssl.hpp"

namespace plchost::security {

/// The largest file of the security folder that is read.
inline constexpr std::size_t kMaxSecurityFile = std::size_t{1} << 20;

/// The whole file. not_found, system: it cannot be read; corrupt: no regular file, or larger
/// than kMaxSecurityFile.
[[nodiscard]] Result<std::string> read_file(const std::string& path);

/// The contents of a PEM file. corrupt: something else, or of a key: it is encrypted.
[[nodiscard]] Result<Certificate> read_certificate(const std::string& path);
[[nodiscard]] Result<Key> read_key(const std::string& path);
[[nodiscard]] Result<RevocationList> read_revocations(const std::string& path);

[[nodiscard]] Result<std::string> to_pem(const Certificate& certificate);
[[nodiscard]] Result<std::string> to_pem(const RevocationList& revocations);
/// PKCS 8, not encrypted: for files that only their owner reads.
[[nodiscard]] Result<std::string> to_pem(const Key& key);

}  // namespace plchost::security
