#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/files/memory_rights.hpp"

namespace plchost {

/// A file that another user has put under one of a host's names in /dev/shm.
struct ForeignFile {
  std::string path;
  std::string rights;  ///< its owner
  Result<void> taken_away;
};

/// Takes away files that have the names of the pool, of its pages and of its memories and do not belong
/// there. Those are files of a user who is not trusted, folders, FIFOs, links. `rights`: those of the pool; a
/// memory that is none of the runtime's own may belong to any user who may write the pool. `api_server`: the
/// user of the API server, which owns the ledger of posts and downloads; nothing: that of the manager. For
/// the manager, before it makes or opens any of them. Set-up.
[[nodiscard]] std::vector<ForeignFile> take_away_foreign_files(
    std::string_view pool, const MemoryRights& rights, std::optional<uid_t> api_server = std::nullopt);

/// Takes the right to write the pages that the manager alone writes from the group, and that to its wishes
/// altogether. A manager of a version before has made them. Set-up.
void protect_managers_files(std::string_view pool) noexcept;

/// Gives the pool's files that belong to this user and to root's group to `group`. A manager before this one
/// had root's group, and its processes have made them. Set-up, and any soft thread later.
void give_roots_files(std::string_view pool, gid_t group) noexcept;

}  // namespace plchost
