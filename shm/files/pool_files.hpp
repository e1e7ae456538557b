#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <sys/types.h>

namespace plchost {

/// The file of a shared memory of the pool: "POOL.memory.NAME"; of the ASCII characters of the name those
/// that check_name() would not allow are there as %XX.
[[nodiscard]] std::string pool_memory_name(std::string_view pool, std::string_view name);
/// The other way round. Nothing: it is no such file.
[[nodiscard]] std::optional<std::string> memory_of_file(std::string_view pool, std::string_view file);

/// The file by which the nodes of a directory for blocks see that others run: "POOL.memory.BASE%locks". No
/// memory can have that name. `directory`: its own file.
[[nodiscard]] std::string node_locks_name(std::string_view directory);

/// Whether the user may write the pool, and so make any object in it. False if there is no pool. Set-up.
[[nodiscard]] bool may_write_pool(std::string_view pool, uid_t user);
/// Whether a shared memory of the pool may belong to the user: a trusted one, or one who may write the pool.
/// Set-up.
[[nodiscard]] bool may_own_memory(std::string_view pool, uid_t user);

/// Removes the names of all shared memories of the pool but those in `kept`; processes that have one mapped
/// keep it. Set-up.
void remove_pool_memories(std::string_view pool, std::span<const std::string> kept = {}) noexcept;

}  // namespace plchost
