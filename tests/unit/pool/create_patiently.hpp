#pragma once

#include <string>

#include "shm/pool/object_pool.hpp"

namespace plchost {

/// A core that stands still holds the pool's lock for longer than one waits for it: then asks again.
inline Result<PoolEvent> create_patiently(ObjectPool& pool, const std::string& name) {
  for (;;) {
    auto event = pool.create_event(name);
    if (event || event.error().code != ErrorCode::timed_out) return event;
  }
}

}  // namespace plchost
