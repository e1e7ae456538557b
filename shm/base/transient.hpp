#pragma once

#include <cerrno>

#include "shm/base/result.hpp"

namespace plchost {

/// What failed may succeed later with nothing changed: the host was short of processes, descriptors, memory
/// or room in a file system (shared memory lies in one), or somebody held a lock for too long.
[[nodiscard]] inline bool is_transient(const Error& error) noexcept {
  switch (error.system_errno) {
    case EAGAIN:
    case EMFILE:
    case ENFILE:
    case ENOMEM:
    case ENOBUFS:
    case ENOSPC:
    case EDQUOT:
    case EINTR:
      return true;
    default:
      return error.code == ErrorCode::busy || error.code == ErrorCode::timed_out;
  }
}

}  // namespace plchost
