#include "api/security/security_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include "api/security/folder_files.hpp"
#include "api/security/identity.hpp"
#include "api/security/pem.hpp"
#include "api/security/policy.hpp"
#include "api/security/signed_document.hpp"
#include "shm/base/names.hpp"
#include "shm/files/replace_file.hpp"

namespace plchost::security {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kIdentityAuthorityKey = "identity_ca_key.pem";
constexpr std::string_view kPermissionsAuthorityKey = "permissions_ca_key.pem";
constexpr std::time_t kDay = 86'400;
Result<void> rename_path(const std::string& from, const std::string& to) {
  if (::rename(from.c_str(), to.c_str()) == 0) return {};
  return failure(ErrorCode::system, fmt::format("cannot rename {} to {}", from, to), errno);
}

Result<void> write_authority(const Authority& authority, const std::string& folder,
                             std::string_view certificate, std::string_view key) {
  PLCHOST_TRY(write_text(file_in(folder, key), to_pem(authority.key), kSecretFile));
  return write_text(file_in(folder, certificate), to_pem(authority.certificate), kPublicFile);
}

Result<Authority> read_authority(const std::string& folder, std::string_view certificate,
                                 std::string_view key) {
  PLCHOST_TRY_ASSIGN(auto public_part, read_certificate(file_in(folder, certificate)));
  PLCHOST_TRY_ASSIGN(auto private_part, read_key(file_in(folder, key)));
  return Authority{std::move(public_part), std::move(private_part)};
}

Result<void> write_authorities(const std::string& to) {
  const Validity validity = validity_for(kDaysOfAuthority);
  PLCHOST_TRY_ASSIGN(const auto identity, make_authority("identity authority", validity));
  PLCHOST_TRY_ASSIGN(const auto permissions, make_authority("permissions authority", validity));
  PLCHOST_TRY(write_authority(identity, to, kIdentityAuthorityFile, kIdentityAuthorityKey));
  PLCHOST_TRY(write_authority(permissions, to, kPermissionsAuthorityFile, kPermissionsAuthorityKey));
  PLCHOST_TRY_ASSIGN(const auto revocations, make_revocations(nullptr, {}, validity, identity));
  PLCHOST_TRY(write_text(file_in(to, kRevocationsFile), to_pem(revocations), kPublicFile));
  return write_text(file_in(to, kGovernanceFile), sign_document(governance_text(), permissions), kPublicFile);
}

/// Removes what was begun unless it was finished.
class Unfinished {
 public:
  explicit Unfinished(std::string path) : path_(std::move(path)) {}
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  ~Unfinished() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  void finished() { path_.clear(); }

 private:
  std::string path_;
};

Result<void> check_days(int days) {
  if (days >= 1 && days <= kDaysOfAuthority) return {};
  return failure(ErrorCode::invalid_argument,
                 fmt::format("{} days are not allowed; allowed are 1 to {}", days, kDaysOfAuthority));
}

}  // namespace

Validity validity_for(int days) {
  const std::time_t now = std::time(nullptr);
  return {.not_before = now - kDay, .not_after = now + days * kDay};
}

Result<void> SecurityFolder::init(const std::string& folder, const std::string& host) {
  std::error_code error;
  const std::string path = fs::absolute(folder, error).lexically_normal().string();
  if (fs::exists(path, error) && !(fs::is_directory(path, error) && fs::is_empty(path, error))) {
    return failure(ErrorCode::already_exists,
                   fmt::format("{} is there already and is no empty folder; nothing was changed", path));
  }
  const std::string fresh =
      fmt::format("{}.new-{}", path.ends_with('/') ? path.substr(0, path.size() - 1) : path, ::getpid());
  Unfinished unfinished(fresh);
  const std::string authorities = file_in(fresh, kAuthoritiesFolder);
  PLCHOST_TRY(make_folder(fresh));
  PLCHOST_TRY(make_folder(authorities));
  PLCHOST_TRY(write_authorities(authorities));
  PLCHOST_TRY_ASSIGN(auto opened, open(fresh));
  PLCHOST_TRY(opened.add(Role::host, host));
  PLCHOST_TRY(rename_path(fresh, path));
  unfinished.finished();
  return sync_directory(fs::path(fresh).parent_path());
}

Result<SecurityFolder> SecurityFolder::open(const std::string& folder) {
  const std::string authorities = file_in(folder, kAuthoritiesFolder);
  UniqueFd lock(::open(authorities.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!lock) {
    return failure(errno == ENOENT ? ErrorCode::not_found : ErrorCode::system,
                   fmt::format("{} is no security folder with its authorities ('plcctl security init' makes "
                               "one): open {}",
                               folder, authorities),
                   errno);
  }
  if (::flock(lock.get(), LOCK_EX) != 0)
    return failure(ErrorCode::system, "cannot lock " + authorities, errno);
  PLCHOST_TRY_ASSIGN(auto identity,
                     read_authority(authorities, kIdentityAuthorityFile, kIdentityAuthorityKey));
  PLCHOST_TRY_ASSIGN(auto permissions,
                     read_authority(authorities, kPermissionsAuthorityFile, kPermissionsAuthorityKey));
  return SecurityFolder(folder, std::move(lock), std::move(identity), std::move(permissions));
}

std::string SecurityFolder::path(std::string_view name) const {
  return file_in(folder_, name);
}

std::string SecurityFolder::authority_file(std::string_view name) const {
  return file_in(path(kAuthoritiesFolder), name);
}

Result<void> SecurityFolder::add(Role role, const std::string& name, int days) {
  PLCHOST_TRY(check_days(days));
  return add_valid({.role = role, .name = name}, validity_for(days));
}

Result<void> SecurityFolder::add_valid(const Subject& subject, const Validity& validity) {
  const std::string& name = subject.name;
  PLCHOST_TRY(check_name("identity", name, kMaxIdentityName));
  if (name == kAuthoritiesFolder) {
    return failure(
        ErrorCode::invalid_argument,
        fmt::format("no identity can be called '{}': that is the folder of the authorities", name));
  }
  std::error_code error;
  const bool is_there = fs::exists(path(name), error);
  if (is_there) {
    PLCHOST_TRY_ASSIGN(const auto known, view(name));
    if (!known.revoked) {
      return failure(ErrorCode::already_exists,
                     fmt::format("there is an identity '{}' ({}); revoke it first, or renew it", name,
                                 to_string(known.subject.role)));
    }
  }
  // Names do not begin with a dot.
  const std::string fresh = path(fmt::format(".{}.new", name));
  fs::remove_all(fresh, error);
  Unfinished unfinished(fresh);
  PLCHOST_TRY(make_folder(fresh));
  PLCHOST_TRY(copy_common(fresh));
  PLCHOST_TRY(write_identity(fresh, subject, validity));
  if (is_there) fs::remove_all(path(name), error);
  PLCHOST_TRY(rename_path(fresh, path(name)));
  unfinished.finished();
  if (subject.role == Role::host) {
    PLCHOST_TRY(know_all(name));
  }
  PLCHOST_TRY(tell_hosts(subject));
  return sync_directory(folder_);
}

Result<void> SecurityFolder::renew(const std::string& name, int days) {
  PLCHOST_TRY(check_days(days));
  PLCHOST_TRY_ASSIGN(const auto known, view(name));
  if (known.revoked) {
    return failure(ErrorCode::wrong_state, fmt::format("'{}' is revoked; add it anew", name));
  }
  PLCHOST_TRY(write_identity(path(name), known.subject, validity_for(days)));
  return tell_hosts(known.subject);
}

Result<void> SecurityFolder::revoke(const std::string& name) {
  PLCHOST_TRY_ASSIGN(const auto known, view(name));
  if (known.revoked) return failure(ErrorCode::wrong_state, fmt::format("'{}' is revoked already", name));
  PLCHOST_TRY_ASSIGN(auto certificates, issued(name));
  PLCHOST_TRY_ASSIGN(auto newest, read_certificate(file_in(path(name), kCertificateFile)));
  certificates.push_back(std::move(newest));
  PLCHOST_TRY_ASSIGN(const auto revocations, read_revocations(authority_file(kRevocationsFile)));
  PLCHOST_TRY_ASSIGN(const auto more,
                     make_revocations(revocations, certificates, validity_for(kDaysOfAuthority), identity_));
  PLCHOST_TRY(write_text(authority_file(kRevocationsFile), to_pem(more), kPublicFile));
  PLCHOST_TRY_ASSIGN(const auto all, names());
  for (const std::string& each : all) {
    PLCHOST_TRY(write_text(file_in(path(each), kRevocationsFile), to_pem(more), kPublicFile));
  }
  return {};
}

Result<std::vector<IdentityView>> SecurityFolder::identities() const {
  PLCHOST_TRY_ASSIGN(const auto all, names());
  std::vector<IdentityView> views;
  for (const std::string& name : all) {
    PLCHOST_TRY_ASSIGN(auto one, view(name));
    views.push_back(std::move(one));
  }
  return views;
}

Result<std::vector<std::string>> SecurityFolder::names() const {
  std::vector<std::string> found;
  std::error_code error;
  auto entry = fs::directory_iterator(folder_, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename();
    std::error_code ignored;
    if (name.starts_with('.') || !fs::exists(entry->path() / kCertificateFile, ignored)) continue;
    found.push_back(name);
  }
  if (error) return failure(ErrorCode::system, "cannot read " + folder_, error.value());
  std::ranges::sort(found);
  return found;
}

}  // namespace plchost::security
