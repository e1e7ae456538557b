#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "manager/supervisor/heartbeat_watch.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The processor time that a process wants of its core and gets, at one moment.
struct ProcessorUse {
  struct ReadyThread {
    pid_t id = 0;
    Duration used{};
    bool operator==(const ReadyThread&) const = default;
  };
  Duration used{};                 ///< by all of its threads, since its start
  std::vector<ReadyThread> ready;  ///< that wait for nothing but the processor
};

/// For how long other programs have kept a process from its core. A thread of it was ready and got nothing,
/// and it was not the process itself that took the core. Pure.
class StarvationWatch {
 public:
  /// One more look, 50 to 200 ms after the one before. true: since then other programs took the core.
  bool look(TimePoint now, const ProcessorUse& use) {
    const Duration gap = now - std::exchange(looked_, now);
    const bool starved = begun_ && in_vain(use) && !takes_the_core(use, gap);
    if (starved) lasted_ += std::min(gap, HeartbeatWatch::kLongestGap);
    before_ = use;
    begun_ = true;
    return starved;
  }
  /// In all looks since forget().
  [[nodiscard]] Duration lasted() const noexcept { return lasted_; }
  void forget() {
    begun_ = false;
    lasted_ = Duration::zero();
  }

 private:
  [[nodiscard]] bool in_vain(const ProcessorUse& use) const {
    return std::ranges::any_of(use.ready, [&](const auto& thread) {
      return std::ranges::find(before_.ready, thread) != before_.ready.end();
    });
  }
  // The rest of the core then would do for the control thread.
  [[nodiscard]] bool takes_the_core(const ProcessorUse& use, Duration gap) const noexcept {
    constexpr int kMost = 3;
    constexpr int kOf = 4;
    return (use.used - before_.used) * kOf >= gap * kMost;
  }

  bool begun_ = false;
  TimePoint looked_;
  ProcessorUse before_;
  Duration lasted_{};
};

}  // namespace plchost
