#include "api/security/security_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/limits.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include "api/security/folder_files.hpp"
#include "api/security/identity.hpp"
#include "api/security/pem.hpp"
#include "api/security/policy.hpp"
#include "api/security/signed_document.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
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

// For good, and at once: both are whole folders, before and after it.
Result<void> exchange_folders(const std::string& fresh, const std::string& old) {
  PLCHOST_TRY(sync_directory(fresh));
  PLCHOST_TRY(check_errno(::renameat2(AT_FDCWD, fresh.c_str(), AT_FDCWD, old.c_str(), RENAME_EXCHANGE),
                          fmt::format("cannot exchange {} and {}", fresh, old)));
  return sync_directory(fs::path(old).parent_path());
}

// In its place another folder would be, and the one behind the link would stay as it is.
Result<void> check_is_no_link(const std::string& folder) {
  std::error_code error;
  if (!fs::is_symlink(folder, error)) return {};
  return failure(ErrorCode::wrong_state,
                 fmt::format("{} is a symbolic link, which cannot be exchanged with a fresh folder; put the "
                             "folder itself there",
                             folder));
}

// The lists of setfacl(1). One that the copy has inherited from the folder above is none of the original.
Result<void> copy_access_lists(const std::string& original, const std::string& copy) {
  for (const char* const list : {"system.posix_acl_access", "system.posix_acl_default"}) {
    std::string value(XATTR_SIZE_MAX, '\0');
    const auto size = ::getxattr(original.c_str(), list, value.data(), value.size());
    if (size < 0 && errno != ENODATA && errno != EOPNOTSUPP)
      return failure(ErrorCode::system, "cannot read the access list of " + original, errno);
    const bool done =
        size < 0 ? ::removexattr(copy.c_str(), list) == 0 || errno == ENODATA || errno == EOPNOTSUPP
                 : ::setxattr(copy.c_str(), list, value.data(), static_cast<std::size_t>(size), 0) == 0;
    if (!done) return failure(ErrorCode::system, "cannot set the access list of " + copy, errno);
  }
  return {};
}

// The mode last: without an access list its bits for the group are those of the group again.
Result<void> give_rights_of(const std::string& original, const std::string& copy) {
  struct stat status{};
  PLCHOST_TRY(check_errno(::stat(original.c_str(), &status), "cannot examine " + original));
  PLCHOST_TRY(check_errno(::chown(copy.c_str(), status.st_uid, status.st_gid), "cannot give " + copy));
  PLCHOST_TRY(copy_access_lists(original, copy));
  PLCHOST_TRY(
      check_errno(::chmod(copy.c_str(), status.st_mode & ALLPERMS), "cannot set the rights of " + copy));
  return {};
}

// As it is, with all files; those that are replaced in the copy stay as they are in the original.
Result<void> copy_folder(const std::string& from, const std::string& to) {
  std::error_code error;
  constexpr auto kOptions =
      fs::copy_options::recursive | fs::copy_options::create_hard_links | fs::copy_options::copy_symlinks;
  fs::copy(from, to, kOptions, error);
  if (error) return failure(ErrorCode::system, fmt::format("cannot copy {}", from), error.value());
  PLCHOST_TRY(give_rights_of(from, to));
  for (fs::recursive_directory_iterator at(from, error), end; !error && at != end; at.increment(error)) {
    if (!at->is_directory(error) || at->is_symlink(error)) continue;
    const std::string copy = to + at->path().string().substr(from.size());
    PLCHOST_TRY(give_rights_of(at->path(), copy));
    PLCHOST_TRY(sync_directory(copy));
  }
  if (error) return failure(ErrorCode::system, "cannot read " + from, error.value());
  return {};
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
  if (folder.empty()) return failure(ErrorCode::invalid_argument, "DIR is empty: name the folder to be made");
  std::error_code error;
  const std::string path = fs::absolute(folder, error).lexically_normal().string();
  if (error) return failure(ErrorCode::system, folder + " has no absolute path here", error.value());
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

// Names do not begin with a dot.
std::string SecurityFolder::fresh_folder(std::string_view name) const {
  return path(fmt::format(".{}{}", name, kFreshFolder));
}

std::string SecurityFolder::authority_file(std::string_view name) const {
  return file_in(path(kAuthoritiesFolder), name);
}

Result<void> SecurityFolder::add(Role role, const std::string& name, int days) {
  PLCHOST_TRY(check_days(days));
  return add_valid({.role = role, .name = name}, validity_for(days));
}

Result<void> SecurityFolder::add_valid(const Subject& subject, const Validity& validity) {
  PLCHOST_TRY(finish_earlier());
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
  PLCHOST_TRY(check_is_no_link(path(name)));
  const std::string fresh = fresh_folder(name);
  Unfinished unfinished(fresh);
  PLCHOST_TRY(make_folder(fresh));
  PLCHOST_TRY(copy_common(fresh));
  PLCHOST_TRY(write_identity(fresh, subject, validity));
  if (subject.role == Role::host) {
    PLCHOST_TRY(know_all(file_in(fresh, kKnownFolder)));
  }
  if (is_there) {
    PLCHOST_TRY(exchange_folders(fresh, path(name)));  // the old one goes with `unfinished`
  } else {
    PLCHOST_TRY(sync_directory(fresh));
    PLCHOST_TRY(rename_path(fresh, path(name)));
    unfinished.finished();
    PLCHOST_TRY(sync_directory(folder_));
  }
  return tell_hosts(name);
}

Result<void> SecurityFolder::renew(const std::string& name, int days) {
  PLCHOST_TRY(check_days(days));
  PLCHOST_TRY(finish_earlier());
  PLCHOST_TRY_ASSIGN(const auto known, view(name));
  if (known.revoked) {
    return failure(ErrorCode::wrong_state, fmt::format("'{}' is revoked; add it anew", name));
  }
  PLCHOST_TRY(check_is_no_link(path(name)));
  const std::string fresh = fresh_folder(name);
  const Unfinished removed_at_the_end(fresh);  // then it is the old one
  PLCHOST_TRY(copy_folder(path(name), fresh));
  PLCHOST_TRY(write_identity(fresh, known.subject, validity_for(days)));
  PLCHOST_TRY(exchange_folders(fresh, path(name)));
  return tell_hosts(name);
}

Result<void> SecurityFolder::revoke(const std::string& name) {
  PLCHOST_TRY_ASSIGN(const auto known, view(name));
  if (known.revoked) {
    PLCHOST_TRY(finish_earlier());
    return failure(ErrorCode::wrong_state, fmt::format("'{}' is revoked already", name));
  }
  PLCHOST_TRY_ASSIGN(auto certificates, issued(name));
  PLCHOST_TRY_ASSIGN(auto newest, read_certificate(file_in(path(name), kCertificateFile)));
  certificates.push_back(std::move(newest));
  PLCHOST_TRY_ASSIGN(const auto revocations, read_revocations(authority_file(kRevocationsFile)));
  PLCHOST_TRY_ASSIGN(const auto more,
                     make_revocations(revocations, certificates, validity_for(kDaysOfAuthority), identity_));
  PLCHOST_TRY(write_text(authority_file(kRevocationsFile), to_pem(more), kPublicFile));
  const auto done = finish_earlier();  // the fresh list, and all else, to each folder
  if (done) return {};
  return failure(done.error().code,
                 fmt::format("'{}' is revoked, but not in all folders: {}", name, done.error().message),
                 done.error().system_errno);
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
