#pragma once

#include <array>
#include <string>
#include <string_view>

#include <sys/types.h>

#include "api/security/identity.hpp"

namespace plchost::security {

/// The folder of the authorities, below the security folder.
inline constexpr std::string_view kAuthoritiesFolder = "authorities";
/// In it: NAME/SERIAL.pem, each certificate that was ever made.
inline constexpr std::string_view kIssuedFolder = "issued";
/// The end of the name of a folder that is not finished.
inline constexpr std::string_view kFreshFolder = ".new";
inline constexpr mode_t kPublicFile = 0644;
inline constexpr mode_t kSecretFile = 0600;

/// Files that are the same for all identities.
inline constexpr std::array kCommonFiles{kIdentityAuthorityFile, kPermissionsAuthorityFile, kGovernanceFile,
                                         kRevocationsFile};

/// Passes on why there is no text, else replaces the file.
[[nodiscard]] Result<void> write_text(const std::string& path, const Result<std::string>& text, mode_t mode);
/// The same, unless the file has that text.
[[nodiscard]] Result<void> renew_text(const std::string& path, const Result<std::string>& text, mode_t mode);
/// A folder of which others see nothing.
[[nodiscard]] Result<void> make_folder(const std::string& path);

}  // namespace plchost::security
