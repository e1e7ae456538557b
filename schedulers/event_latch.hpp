#pragma once

#include <atomic>
#include <cstdint>

#include "schedulers/activation_gate.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The rising edges of one event task's BOOL, between the poller that sees them and the task that runs for
/// them. Keeps one run that has not begun; edges beyond it are counted as lost. Part of the task, so that
/// neither the level nor a run that is due is forgotten when the scheduler is exchanged.
class EventLatch {
 public:
  /// Forgets what was due, and the level. While nobody polls or waits.
  void forget() noexcept {
    primed_ = false;
    lost_.store(0, std::memory_order_relaxed);
    gate.close();
  }
  [[nodiscard]] bool primed() const noexcept { return primed_; }
  /// The level from which the first edge is to rise. The poller's thread, before its first poll.
  void prime(bool level) noexcept {
    level_ = level;
    primed_ = true;
  }

  /// One look at the variable, at `now`. true: an edge rose. The poller's thread, real-time.
  bool poll(Clock& clock, bool level, TimePoint now) noexcept {
    const bool rose = level && !level_;
    level_ = level;
    if (!rose) return false;
    if (gate.is_open()) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return true;
    }
    seen_at_.store(now.time_since_epoch().count(), std::memory_order_relaxed);
    gate.open(clock);
    return true;
  }

  /// When the edge was seen that opened the gate. The task's thread, after the gate let it pass.
  [[nodiscard]] TimePoint seen_at() const noexcept {
    return TimePoint(Duration(seen_at_.load(std::memory_order_relaxed)));
  }
  /// Edges lost since the last call. The task's thread.
  [[nodiscard]] std::uint64_t take_lost() noexcept { return lost_.exchange(0, std::memory_order_relaxed); }

  ActivationGate gate;

 private:
  bool level_ = false;  // the poller's alone
  bool primed_ = false;
  std::atomic<Duration::rep> seen_at_{0};
  std::atomic<std::uint64_t> lost_{0};
};

/// How far an external-event task has come in its event. Part of the task; only its thread uses it.
struct EventCursor {
  std::uint64_t next = 0;  ///< posts that were run or lost
  std::uint64_t seen = 0;  ///< posts that were seen at `seen_at`
  TimePoint seen_at;
};

}  // namespace plchost
