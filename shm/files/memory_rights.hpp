#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <sys/stat.h>
#include <sys/types.h>

#include "shm/base/result.hpp"

namespace plchost {

/// The rights to a shared memory, as with any file.
struct MemoryRights {
  std::optional<uid_t> owner = std::nullopt;  ///< nothing: the caller
  std::optional<gid_t> group = std::nullopt;  ///< nothing: the caller's
  mode_t mode = 0660;                         ///< permission bits, whatever the umask
};

/// Whether a file of that owner may be used. Anybody can make files in /dev/shm, of any name that is not
/// taken.
using OwnerCheck = std::function<bool(uid_t owner)>;
/// root, and the user of the calling process: those who could do all that this process does anyway.
[[nodiscard]] bool is_own_or_roots(uid_t owner) noexcept;
/// The same, and the users of instances: their pages are read, and no more than that follows from them.
[[nodiscard]] bool is_trusted_owner(uid_t owner) noexcept;
/// From now on this process takes the pages of instances from that user, too. At most kMostInstanceUsers:
/// the configured one, and those of instances that run since before it. False: there are so many. Set-up.
bool trust_instances_of(uid_t user) noexcept;
inline constexpr std::size_t kMostInstanceUsers = 8;
[[nodiscard]] std::vector<uid_t> users_of_instances();
/// For a client that joins what another user has set up: the files of a host belong to the user that runs it.
[[nodiscard]] bool is_any_owner(uid_t owner) noexcept;

/// The rights of the calling process to an object. Root may do all. Set-up.
struct Permission {
  bool read = false;
  bool write = false;
};
[[nodiscard]] Permission permission_for_caller(uid_t owner, gid_t group, mode_t mode);

/// Whether these rights let a user write: as owner, as a member of the group, or as anybody. Set-up.
[[nodiscard]] bool allows_to_write(const MemoryRights& rights, uid_t user);

/// Whether the calling process may make a file, or an object, that belongs to the group: it is in it, or
/// root.
[[nodiscard]] bool may_give_to(gid_t group);

/// Whether a file has these rights already. An owner or a group that is left open is any.
[[nodiscard]] bool has_rights(const struct stat& status, const MemoryRights& rights) noexcept;

/// "owner 0, group 1000, mode 0660", for errors.
[[nodiscard]] std::string describe_rights(uid_t owner, gid_t group, mode_t mode);

/// Gives a file to owner and group. refused: the caller may not. Set-up.
[[nodiscard]] Result<void> give_rights(int fd, const MemoryRights& rights, const std::string& path);

}  // namespace plchost
