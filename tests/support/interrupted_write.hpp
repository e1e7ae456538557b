#pragma once

#include <atomic>
#include <cstdint>

#include "shm/base/seqlock.hpp"

namespace plchost {

/// The place of a writer that lost its processor within write(): readers get nothing until the next write().
template <class T>
void interrupt_write(Seqlock<T>& place) noexcept {
  reinterpret_cast<std::atomic<std::uint64_t>*>(&place)->fetch_or(1);
}

}  // namespace plchost
