#pragma once

#include <atomic>
#include <cstdint>

#include "shm/base/time.hpp"

namespace plchost {

/// The longest time between two signs of life.
class Stall {
 public:
  void sign() {
    const std::int64_t now = MonotonicClock::now().time_since_epoch().count();
    const std::int64_t before = last_.exchange(now);
    if (before != 0 && now - before > longest_.load()) longest_.store(now - before);
  }
  /// The longest one since the last call, the present one included.
  Duration take() {
    sign();
    return Duration(longest_.exchange(0));
  }

 private:
  std::atomic<std::int64_t> last_{0};
  std::atomic<std::int64_t> longest_{0};
};

}  // namespace plchost
