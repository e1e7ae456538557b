#pragma once

#include <string>
#include <vector>

#include "api/security/certificates.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost::security {

inline constexpr int kDaysOfAuthority = 7300;
inline constexpr int kDaysOfIdentity = 825;

/// One identity of the folder.
struct IdentityView {
  Subject subject;
  Validity validity;
  bool revoked = false;
  GuidPrefix prefix{};
};

/// The folder of `plcctl security`. DIR/authorities holds the two authorities and their keys. Only the
/// plant's administrator keeps DIR/authorities. DIR/NAME is the folder of the identity NAME, to be copied to
/// where it is used. The owner of such an object has the folder alone. Files are replaced as a whole.
class SecurityFolder {
 public:
  /// A fresh folder with its authorities and the identity of the plant's first host, which must be called as
  /// the host is. All or nothing. already_exists: there is something in it.
  [[nodiscard]] static Result<void> init(const std::string& folder, const std::string& host);
  /// not_found: init() has not made it.
  [[nodiscard]] static Result<SecurityFolder> open(const std::string& folder);

  /// A key, certificate and permissions for a name that is new, or revoked. already_exists: it is neither.
  [[nodiscard]] Result<void> add(Role role, const std::string& name, int days = kDaysOfIdentity);
  /// The same role and name with a fresh key and certificate; the old one stays valid until it ends, or until
  /// the name is revoked. In one step: if this process is ended, key and certificate belong together.
  /// wrong_state: it is revoked, or its folder is a symbolic link.
  [[nodiscard]] Result<void> renew(const std::string& name, int days = kDaysOfIdentity);
  /// All certificates that were ever made for that name are worth nothing from now on, in every folder that
  /// is brought up to date. The authority's list comes first. A folder that cannot be written keeps none of
  /// the others from its list: the first such error is returned, and the next command tries again.
  [[nodiscard]] Result<void> revoke(const std::string& name);
  /// All identities, by name.
  [[nodiscard]] Result<std::vector<IdentityView>> identities() const;

  /// For any time, also one that is over: the work of add().
  [[nodiscard]] Result<void> add_valid(const Subject& subject, const Validity& validity);

 private:
  SecurityFolder(std::string folder, UniqueFd lock, Authority identity, Authority permissions)
      : folder_(std::move(folder)),
        lock_(std::move(lock)),
        identity_(std::move(identity)),
        permissions_(std::move(permissions)) {}

  [[nodiscard]] std::string path(std::string_view name) const;
  /// Where the folder of an identity is made, before it gets its name.
  [[nodiscard]] std::string fresh_folder(std::string_view name) const;
  [[nodiscard]] std::string authority_file(std::string_view name) const;
  [[nodiscard]] Result<IdentityView> view(const std::string& name) const;
  [[nodiscard]] Result<std::vector<std::string>> names() const;
  [[nodiscard]] Result<void> write_identity(const std::string& to, const Subject& subject,
                                            const Validity& validity) const;
  /// So that it can be revoked when the identity has another one.
  [[nodiscard]] Result<void> keep_issued(const std::string& name, const Certificate& certificate) const;
  /// All that were made for that name.
  [[nodiscard]] Result<std::vector<Certificate>> issued(const std::string& name) const;
  [[nodiscard]] Result<void> copy_common(const std::string& to) const;
  [[nodiscard]] Result<void> tell_hosts(const std::string& identity) const;
  [[nodiscard]] Result<void> know_all(const std::string& known) const;
  /// Folders that an earlier command has not brought up to date. All of them; the first error.
  [[nodiscard]] Result<void> finish_earlier() const;

  std::string folder_;
  UniqueFd lock_;
  Authority identity_;
  Authority permissions_;
};

/// From a day ago, so that clocks that differ a little do not matter, for that many days.
[[nodiscard]] Validity validity_for(int days);

}  // namespace plchost::security
