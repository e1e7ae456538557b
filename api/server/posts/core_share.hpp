#pragma once

#include <algorithm>

#include "shm/base/time.hpp"

namespace plchost {

/// Keeps a real-time thread that always has something to do from having its core for itself: the kernel would
/// give the others on it (the manager, clients of this host) 50 ms once in a second, and this thread nothing
/// meanwhile. One thread.
class CoreShare {
 public:
  /// The thread rests so that it has at most kPercent of the time, looked at every kWindow.
  static constexpr int kPercent = 90;
  static constexpr Duration kWindow = std::chrono::milliseconds(5);

  /// To be called often: sleeps if it is time to.
  void rest_if_due() noexcept;

  /// How long to rest after having run for `used` of `elapsed`.
  [[nodiscard]] static constexpr Duration rest_after(Duration elapsed, Duration used) noexcept {
    return std::max(used * 100 / kPercent - elapsed, Duration::zero());
  }

 private:
  TimePoint window_begin_{};
  Duration used_before_{};
};

}  // namespace plchost
