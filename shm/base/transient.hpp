#pragma once

#include <cerrno>

#include "shm/base/result.hpp"

namespace plchost {

/// The failed call may succeed later with nothing changed. The host was short of processes, descriptors,
/// memory or room in a file system (shared memory lies in one), or a lock was held for too long.
[[nodiscard]] inline bool is_transient(const Error& error) noexcept {
  switch (error.system_errno) {
    case EAGAIN:
    case EMFILE:
    case ENFILE:
    case ENOMEM:
    case ENOBUFS:
    case ENOSPC:
    case EDQUOT:
    case ENOLCK:
    case EINTR:
      return true;
    default:
      return error.code == ErrorCode::busy || error.code == ErrorCode::timed_out;
  }
}

}  // namespace plchost
