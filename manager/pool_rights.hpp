#pragma once

#include <optional>
#include <string>

#include <sys/types.h>

#include "manager/config/manager_config.hpp"
#include "shm/base/result.hpp"
#include "shm/files/memory_rights.hpp"

namespace plchost {

class ObjectPool;

/// Refuses a pool that is there already and belongs to a user who is neither this one, nor root, nor the
/// configured owner. Otherwise the user that makes a file in /dev/shm first could own all that instances
/// share.
[[nodiscard]] Result<void> check_pool_owner(const std::string& pool, const MemoryRights& rights);

/// Sets the rights to the pool, as [host] pool_owner, pool_group and pool_mode say.
[[nodiscard]] Result<MemoryRights> pool_rights(const HostConfig& host);

/// Takes away what other users have put under the names of this pool, and logs whose it was, or why it
/// cannot. `api_server`: the user of the API server, if it has one of its own.
void clear_names(const std::string& pool, const MemoryRights& rights, std::optional<uid_t> api_server);

/// Gives a pool that is there the rights that the configuration says, and logs that. Objects that are in it
/// already keep their rights; a process that has it mapped keeps it. refused, system: the pool keeps the
/// rights it has.
[[nodiscard]] Result<void> renew_pool_rights(const std::string& pool, const MemoryRights& rights);

/// Says in the log that a pool that was there already is for several containers, or is not, and
/// [host] pool_across_containers wants the other. Set-up.
void warn_of_another_kind(const ObjectPool& pool, const HostConfig& host);

}  // namespace plchost
