#include "api/security/identity.hpp"

#include <filesystem>

#include <fmt/format.h>
#include <openssl/err.h>

#include "api/security/pem.hpp"
#include "api/security/signed_document.hpp"

namespace plchost::security {

namespace {

namespace fs = std::filesystem;

Result<void> check_key(const std::string& path, const Certificate& certificate) {
  std::error_code error;
  const fs::perms mode = fs::status(path, error).permissions();
  constexpr fs::perms kOthers = fs::perms::group_all | fs::perms::others_all;
  if (!error && (mode & kOthers) != fs::perms::none) {
    return failure(ErrorCode::refused,
                   fmt::format("{} can be read or written by others than its owner: chmod 600 it", path));
  }
  PLCHOST_TRY_ASSIGN(const auto key, read_key(path));
  if (X509_check_private_key(certificate.get(), key.get()) == 1) return {};
  ERR_clear_error();
  return failure(ErrorCode::corrupt,
                 fmt::format("{} is not the key of {} beside it", path, kCertificateFile));
}

Result<void> check_documents(const std::string& folder, const Certificate& certificate) {
  PLCHOST_TRY_ASSIGN(const auto authority, read_certificate(file_in(folder, kPermissionsAuthorityFile)));
  std::string permissions;
  for (const std::string_view file : {kGovernanceFile, kPermissionsFile}) {
    const std::string path = file_in(folder, file);
    PLCHOST_TRY_ASSIGN(const auto document, read_file(path));
    PLCHOST_TRY_ASSIGN(permissions, open_document(path, document, authority));
  }
  PLCHOST_TRY_ASSIGN(const auto subject, subject_text(certificate));
  if (permissions.contains(fmt::format("<subject_name>{}</subject_name>", subject))) return {};
  return failure(ErrorCode::refused, fmt::format("{} are the permissions of another identity than '{}'",
                                                 file_in(folder, kPermissionsFile), subject));
}

}  // namespace

std::string file_in(const std::string& folder, std::string_view file) {
  return folder + "/" + std::string(file);
}

Result<void> check_host_identity(const Subject& subject, std::string_view host) {
  if (subject.role == Role::host && subject.name == host) return {};
  const std::string advice =
      fmt::format("set [dds] identity to the folder that 'plcctl security add-identity host {}' makes", host);
  if (subject.role != Role::host) {
    return failure(ErrorCode::refused, fmt::format("'{}' has the role {}; a host's is needed: {}",
                                                   subject.name, to_string(subject.role), advice));
  }
  return failure(ErrorCode::refused,
                 fmt::format("'{}' is that of another host than '{}': {}", subject.name, host, advice));
}

Result<OwnIdentity> check_identity(const std::string& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    return failure(
        ErrorCode::not_found,
        fmt::format("'{}' is no folder of an identity; 'plcctl security add-identity' makes one", folder),
        error.value());
  }
  PLCHOST_TRY_ASSIGN(const auto certificate, read_certificate(file_in(folder, kCertificateFile)));
  PLCHOST_TRY_ASSIGN(const auto authority, read_certificate(file_in(folder, kIdentityAuthorityFile)));
  PLCHOST_TRY_ASSIGN(const auto revocations, read_revocations(file_in(folder, kRevocationsFile)));
  PLCHOST_TRY(in_step(folder, verify_revocations(revocations, authority)));
  PLCHOST_TRY(in_step(folder, verify_certificate(certificate, authority, revocations)));
  PLCHOST_TRY(check_key(file_in(folder, kKeyFile), certificate));
  PLCHOST_TRY(check_documents(folder, certificate));
  PLCHOST_TRY_ASSIGN(auto subject, in_step(folder, subject_of(certificate)));
  PLCHOST_TRY_ASSIGN(const auto validity, in_step(folder, validity_of(certificate)));
  return OwnIdentity{std::move(subject), validity};
}

}  // namespace plchost::security
