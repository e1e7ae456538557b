#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <sys/types.h>

#include "shm/pool/pool_layout.hpp"

namespace plchost {

/// A process that holds an object.
struct ReferenceInfo {
  std::uint32_t pid = 0;  ///< in the PID namespace of the caller; 0: it cannot be seen from there
  std::string program;
  bool writable = false;
  std::uint32_t waiting = 0;  ///< so many of its threads wait for the object
  // Of the process, see ProcessIdentity. Of a pool across containers: its ClientLocks::number(), and 0.
  std::uint64_t start = 0;
  std::uint32_t image = 0;
};

/// One object as others see it.
struct ObjectInfo {
  std::string name;
  ObjectType type = ObjectType::memory;
  std::uint64_t value = 0;  ///< event: posts so far; semaphore: its value; mutex: thread that holds it, or 0
  std::uint64_t size = 0;   ///< memory: bytes
  bool registered = false;  ///< event: may be posted to
  std::uint32_t bound_tasks = 0;  ///< event
  std::uint32_t waiters = 0;      ///< threads that wait for it, and bound tasks
  bool kept = false;              ///< stays without references
  uid_t owner = 0;
  gid_t group = 0;
  mode_t mode = 0;
  std::int64_t made_unix_ns = 0;
  /// At most kMostReferencesTold of them.
  std::vector<ReferenceInfo> references;
  std::uint32_t reference_count = 0;
  /// Mutex of a pool across containers: of the process that holds it, as `start` of its reference; 0: none.
  std::uint32_t holder = 0;
};

inline constexpr std::uint32_t kMostReferencesTold = 64;

}  // namespace plchost
