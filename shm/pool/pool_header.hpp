#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "shm/base/result.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_layout.hpp"

namespace plchost {

// The constants of a pool: its header has them from its making on. All functions are set-up.

/// `version`: kPoolVersion or kPoolVersionAcross. `pid_namespace`: see PoolHeader.
void write_pool_constants(PoolHeader& header, std::uint32_t version, std::uint32_t max_objects,
                          std::uint64_t pid_namespace) noexcept;
/// Of a new pool. `locks_file`: see ClientLocks::make(), if it is across containers.
[[nodiscard]] Result<void> fill_pool_header(std::span<std::byte> bytes, const PoolOptions& options,
                                            std::uint64_t locks_file);
/// corrupt: another version, or it does not fit the size of the file.
[[nodiscard]] Result<void> check_pool_header(const PoolHeader& header, std::uint32_t max_objects,
                                             std::size_t file_size, const std::string& name);
/// Whether the second copy of the constants is good, which a stranger who writes over the first one seldom
/// meets.
[[nodiscard]] bool is_pool_sound_again(const PoolHeader& header, std::uint32_t max_objects,
                                       std::size_t file_size) noexcept;
/// Whether its users may be in several PID namespaces.
[[nodiscard]] bool is_pool_across(const PoolHeader& header, std::size_t file_size) noexcept;
/// refused: it is for one PID namespace, and the caller is in another one.
[[nodiscard]] Result<void> check_pid_namespace(const PoolHeader& header, const std::string& name);

}  // namespace plchost
