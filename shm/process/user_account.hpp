#pragma once

#include <string>
#include <vector>

#include <sys/types.h>

#include "shm/base/result.hpp"

namespace plchost {

/// A user of this host that is not root.
struct UserAccount {
  uid_t number = 0;
  gid_t group = 0;            ///< its own; of a number that no account has: the group of the same number
  std::vector<gid_t> groups;  ///< all of them, the own one too
};

/// By name or number. invalid_argument: there is no such user, or it is root. Set-up: may ask a directory
/// service.
[[nodiscard]] Result<UserAccount> find_user(const std::string& text);

/// Makes the process one of that user, for good: with the group that it has now, and the groups of the user.
/// refused: the process may not. Before other threads are made. Set-up.
[[nodiscard]] Result<void> take_user(const UserAccount& user);

/// As long as this exists, the thread opens and makes files as that user, whose own group it has beside its
/// own groups. Without the right to that it changes nothing. Set-up, and soft threads.
class FilesAsUser {
 public:
  FilesAsUser(uid_t user, gid_t group) noexcept;
  ~FilesAsUser();
  FilesAsUser(const FilesAsUser&) = delete;
  FilesAsUser& operator=(const FilesAsUser&) = delete;
  /// Whether the change took: else the thread opens files with rights that it should not use here.
  [[nodiscard]] bool can() const noexcept { return can_; }

 private:
  std::vector<gid_t> groups_;
  uid_t before_;
  int dumpable_;
  bool can_ = false;
};

}  // namespace plchost
