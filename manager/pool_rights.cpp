#include "manager/pool_rights.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "manager/config/accounts.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/foreign_files.hpp"
#include "shm/pool/client_locks.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

Result<MemoryRights> pool_rights(const HostConfig& host) {
  MemoryRights rights{.mode = host.pool_mode};
  if (!host.pool_owner.empty()) {
    PLCHOST_TRY_ASSIGN(rights.owner, in_step("[host] pool_owner", user_number(host.pool_owner)));
  }
  if (!host.pool_group.empty()) {
    PLCHOST_TRY_ASSIGN(rights.group, in_step("[host] pool_group", group_number(host.pool_group)));
  }
  return rights;
}

Result<void> check_pool_owner(const std::string& pool, const MemoryRights& rights) {
  const std::string path = MemoryFile::path(pool);
  struct stat status{};
  if (::lstat(path.c_str(), &status) != 0) return {};
  const uid_t owner = status.st_uid;
  if (owner == 0 || owner == ::geteuid() || owner == rights.owner) return {};
  return failure(
      ErrorCode::refused,
      fmt::format("pool '{}' is there already and belongs to user {}: remove {}, give [host] pool another "
                  "name, or name that user as pool_owner",
                  pool, owner, path));
}

void clear_names(const std::string& pool, const MemoryRights& rights, std::optional<uid_t> api_server) {
  for (const ForeignFile& file : take_away_foreign_files(pool, rights, api_server)) {
    if (file.taken_away) {
      spdlog::warn("{} was put there by another user ({}); it is removed and not used", file.path,
                   file.rights);
    } else {
      spdlog::warn("{} was put there by another user: {}", file.path, file.taken_away.error().describe());
    }
  }
}

Result<void> renew_pool_rights(const std::string& pool, const MemoryRights& rights) {
  const std::string path = MemoryFile::path(pool);
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  struct stat before{};
  if (!fd || ::fstat(fd.get(), &before) != 0) {
    return failure(ErrorCode::system, fmt::format("cannot read the rights of pool '{}'", pool), errno);
  }
  PLCHOST_TRY(ClientLocks::renew_rights(pool, rights));
  if (has_rights(before, rights)) return {};
  const std::string had = describe_rights(before.st_uid, before.st_gid, before.st_mode);
  PLCHOST_TRY(in_step(fmt::format("pool '{}' keeps {}", pool, had), give_rights(fd.get(), rights, path)));
  struct stat now{};
  if (::fstat(fd.get(), &now) != 0) return {};
  spdlog::info("pool '{}' had {}; it has {} now", pool, had,
               describe_rights(now.st_uid, now.st_gid, now.st_mode));
  return {};
}

void warn_of_another_kind(const ObjectPool& pool, const HostConfig& host) {
  if (pool.across_containers() == host.pool_across_containers) return;
  spdlog::warn(
      "pool '{}' was made with [host] pool_across_containers = {} and stays so; for {} stop the manager and "
      "all programs that use the pool, remove {} and start the manager",
      pool.name(), pool.across_containers(), host.pool_across_containers, MemoryFile::path(pool.name()));
}

}  // namespace plchost
