// The files of the security folder: see security_folder.hpp.
#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sys/stat.h>

#include "api/security/folder_files.hpp"
#include "api/security/pem.hpp"
#include "api/security/policy.hpp"
#include "api/security/security_folder.hpp"
#include "api/security/signed_document.hpp"
#include "shm/base/names.hpp"
#include "shm/files/replace_file.hpp"

namespace plchost::security {

namespace fs = std::filesystem;

namespace {

// One folder that cannot be written keeps nothing from the others.
void keep_first(Result<void>& first, Result<void> next) {
  if (first && !next) first = std::move(next);
}

}  // namespace

Result<void> write_text(const std::string& path, const Result<std::string>& text, mode_t mode) {
  PLCHOST_TRY_ASSIGN(const auto& contents, text);
  return replace_file(path, contents, mode);
}

Result<void> renew_text(const std::string& path, const Result<std::string>& text, mode_t mode) {
  const auto known = read_file(path);
  return known && text && *known == *text ? Result<void>() : write_text(path, text, mode);
}

Result<void> make_folder(const std::string& path) {
  if (::mkdir(path.c_str(), 0700) == 0) return {};
  return failure(errno == EEXIST ? ErrorCode::already_exists : ErrorCode::system,
                 "cannot create the folder " + path, errno);
}

Result<IdentityView> SecurityFolder::view(const std::string& name) const {
  PLCHOST_TRY(check_name("identity", name, kMaxIdentityName));
  PLCHOST_TRY_ASSIGN(const auto certificate,
                     if_found(read_certificate(file_in(path(name), kCertificateFile))));
  if (!certificate) {
    PLCHOST_TRY_ASSIGN(const auto all, names());
    const std::vector<std::string_view> known(all.begin(), all.end());
    return failure(ErrorCode::not_found,
                   fmt::format("no identity '{}' in {}; there are: {}", name, folder_, join_names(known)));
  }
  PLCHOST_TRY_ASSIGN(const auto revocations, read_revocations(authority_file(kRevocationsFile)));
  PLCHOST_TRY_ASSIGN(auto subject, in_step(path(name), subject_of(*certificate)));
  PLCHOST_TRY_ASSIGN(const auto validity, validity_of(*certificate));
  PLCHOST_TRY_ASSIGN(const auto prefix, guid_prefix(*certificate));
  return IdentityView{std::move(subject), validity, is_revoked(*certificate, revocations), prefix};
}

Result<void> SecurityFolder::write_identity(const std::string& to, const Subject& subject,
                                            const Validity& validity) const {
  PLCHOST_TRY_ASSIGN(const auto key, make_key());
  PLCHOST_TRY_ASSIGN(const auto certificate, issue_certificate(subject, validity, key, identity_));
  PLCHOST_TRY_ASSIGN(const auto text, subject_text(certificate));
  PLCHOST_TRY_ASSIGN(const auto prefix, guid_prefix(certificate));
  PLCHOST_TRY(keep_issued(subject.name, certificate));
  const auto permissions = sign_document(permissions_text(subject, text, prefix, validity), permissions_);
  PLCHOST_TRY(write_text(file_in(to, kPermissionsFile), permissions, kPublicFile));
  PLCHOST_TRY(write_text(file_in(to, kKeyFile), to_pem(key), kSecretFile));
  return write_text(file_in(to, kCertificateFile), to_pem(certificate), kPublicFile);
}

// First of all: no certificate is anywhere that is not kept here.
Result<void> SecurityFolder::keep_issued(const std::string& name, const Certificate& certificate) const {
  PLCHOST_TRY_ASSIGN(const auto serial, serial_text(certificate));
  const std::string all = authority_file(kIssuedFolder);
  const std::string of_name = file_in(all, name);
  for (const std::string& folder : {all, of_name}) {
    if (auto made = make_folder(folder); !made && made.error().code != ErrorCode::already_exists) return made;
  }
  return write_text(file_in(of_name, serial + ".pem"), to_pem(certificate), kPublicFile);
}

Result<std::vector<Certificate>> SecurityFolder::issued(const std::string& name) const {
  const std::string folder = file_in(authority_file(kIssuedFolder), name);
  std::vector<Certificate> found;
  std::error_code error;
  auto entry = fs::directory_iterator(folder, error);
  if (error == std::errc::no_such_file_or_directory) return found;
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (entry->path().extension() != ".pem") continue;
    PLCHOST_TRY_ASSIGN(auto certificate, read_certificate(entry->path()));
    found.push_back(std::move(certificate));
  }
  if (error) return failure(ErrorCode::system, "cannot read " + folder, error.value());
  return found;
}

Result<void> SecurityFolder::copy_common(const std::string& to) const {
  for (const std::string_view file : kCommonFiles) {
    PLCHOST_TRY(write_text(file_in(to, file), read_file(authority_file(file)), kPublicFile));
  }
  return {};
}

// Hosts know the certificates of all, to know who is behind what was written.
Result<void> SecurityFolder::tell_hosts(const std::string& identity) const {
  PLCHOST_TRY_ASSIGN(const auto all, names());
  const auto certificate = read_file(file_in(path(identity), kCertificateFile));
  Result<void> told;
  for (const std::string& name : all) {
    const std::string known = file_in(path(name), kKnownFolder);
    std::error_code ignored;
    if (!fs::is_directory(known, ignored)) continue;
    keep_first(told, renew_text(file_in(known, identity + ".pem"), certificate, kPublicFile));
  }
  return told;
}

Result<void> SecurityFolder::know_all(const std::string& known) const {
  PLCHOST_TRY(make_folder(known));
  PLCHOST_TRY_ASSIGN(const auto all, names());
  for (const std::string& name : all) {
    const auto certificate = read_file(file_in(path(name), kCertificateFile));
    PLCHOST_TRY(write_text(file_in(known, name + ".pem"), certificate, kPublicFile));
  }
  return sync_directory(known);
}

Result<void> SecurityFolder::finish_earlier() const {
  std::error_code error;
  std::vector<fs::path> unfinished;
  for (fs::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename();
    if (name.starts_with('.') && name.ends_with(kFreshFolder)) unfinished.push_back(at->path());
  }
  for (const fs::path& each : unfinished) fs::remove_all(each, error);
  PLCHOST_TRY_ASSIGN(const auto all, names());
  Result<void> finished;
  for (const std::string& name : all) {
    for (const std::string_view file : kCommonFiles) {
      const auto text = read_file(authority_file(file));
      keep_first(finished, renew_text(file_in(path(name), file), text, kPublicFile));
    }
    keep_first(finished, tell_hosts(name));
  }
  return finished;
}

}  // namespace plchost::security
