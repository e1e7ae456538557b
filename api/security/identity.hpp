#pragma once

#include <ctime>
#include <string>
#include <string_view>

#include "api/security/certificates.hpp"

namespace plchost::security {

/// The files in the folder of one identity: all that its process needs, so the folder can be copied to where
/// that runs.
inline constexpr std::string_view kIdentityAuthorityFile = "identity_ca.pem";
inline constexpr std::string_view kPermissionsAuthorityFile = "permissions_ca.pem";
inline constexpr std::string_view kGovernanceFile = "governance.p7s";
inline constexpr std::string_view kPermissionsFile = "permissions.p7s";
inline constexpr std::string_view kCertificateFile = "certificate.pem";
inline constexpr std::string_view kKeyFile = "key.pem";
inline constexpr std::string_view kRevocationsFile = "revoked.pem";
/// Of a host: the certificates of all identities, NAME.pem.
inline constexpr std::string_view kKnownFolder = "known";

/// A certificate that ends sooner is worth a word.
inline constexpr std::time_t kExpiresSoon = std::time_t{30} * 86'400;

/// An identity that a process can show.
struct OwnIdentity {
  Subject subject;
  Validity validity;
};

/// Whether the folder holds an identity that will be accepted. Each file must be there and of the right kind.
/// The key must be the certificate's, and its owner's only. The certificate must be valid now, signed by the
/// authority and not revoked. Governance and permissions must be signed. The error names the file and what to
/// do.
[[nodiscard]] Result<OwnIdentity> check_identity(const std::string& folder);

/// refused: not the identity of the host of that name, so that no other host and no client would believe it.
[[nodiscard]] Result<void> check_host_identity(const Subject& subject, std::string_view host);

/// "folder/file".
[[nodiscard]] std::string file_in(const std::string& folder, std::string_view file);

}  // namespace plchost::security
