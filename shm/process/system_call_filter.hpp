#pragma once

#include <cerrno>
#include <cstdint>
#include <span>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// A system call that fails.
struct RefusedCall {
  std::uint32_t number = 0;
  std::string_view name;
  std::uint32_t flags = 0;  ///< it fails only with one of these in its first argument; 0: always
  int error = EPERM;        ///< its errno; ENOSYS: as if the kernel did not have it
};

/// From here on these calls fail in all threads of the process and in all processes that it forks. So does
/// each call of another ABI (i386, x32), whose numbers mean other calls: EPERM. Nothing takes that back. The
/// kernel writes each call that gets EPERM with the name of its thread into its audit log. Those that get
/// another error are no news: the C library tries another way. refused: another thread has a filter of its
/// own. system: the kernel has no filters, or the process may set none; it needs
/// refuse_new_rights(). Set-up.
[[nodiscard]] Result<void> refuse_system_calls(std::span<const RefusedCall> calls);

}  // namespace plchost
