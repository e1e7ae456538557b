#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <optional>

#include "schedulers/tasks/activation_gate.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The rising edges of one event task, between the poller that sees them and the task that runs for them. Of
/// its BOOL's edges it keeps one run that has not begun. Of the edges that the application raises by call it
/// keeps as many as `backlog` allows. More are counted as lost. Part of the task, so that neither the level
/// nor a run that is due is forgotten when the scheduler is exchanged.
class EventLatch {
 public:
  /// Forgets what was due, and the level. While nobody polls or waits.
  void forget() noexcept {
    primed_ = false;
    taken_ = raised_.load(std::memory_order_relaxed);
    due_.store(0, std::memory_order_relaxed);
    lost_.store(0, std::memory_order_relaxed);
    gate.close();
  }
  [[nodiscard]] bool primed() const noexcept { return primed_; }
  /// The level from which the first edge is to rise. The poller's thread, before its first poll.
  void prime(bool level) noexcept {
    level_ = level;
    primed_ = true;
  }

  /// One edge, whatever the variable is. From the first call on only calls count. Any context.
  void raise() noexcept { raised_.fetch_add(1, std::memory_order_release); }
  /// Whether raise() was called: then poll_raised() is to be used.
  [[nodiscard]] bool is_raised() const noexcept { return raised_.load(std::memory_order_relaxed) != 0; }

  /// One look at the variable, at `now`. true: an edge rose. The poller's thread, real-time.
  bool poll(Clock& clock, bool level, TimePoint now) noexcept {
    const bool rose = level && !level_;
    level_ = level;
    if (rose) keep(clock, 1, 1, now);
    return rose;
  }

  /// One look at the calls of raise(), at `now`; how many there were since the last look. The poller's
  /// thread, real-time.
  std::uint64_t poll_raised(Clock& clock, TimePoint now, std::uint64_t backlog) noexcept {
    const std::uint64_t edges = raised_.load(std::memory_order_acquire) - taken_;
    taken_ += edges;
    if (edges != 0) keep(clock, edges, backlog, now);
    return edges;
  }

  /// A run is due that has not begun. Any thread.
  [[nodiscard]] bool is_due() const noexcept { return due_.load(std::memory_order_relaxed) != 0; }
  /// When the edge was seen whose run has begun; nothing: none is due. The task's thread.
  [[nodiscard]] std::optional<TimePoint> take() noexcept {
    if (due_.load(std::memory_order_acquire) == 0) return std::nullopt;
    const TimePoint seen{Duration(seen_at_.load(std::memory_order_relaxed))};
    due_.fetch_sub(1, std::memory_order_acq_rel);
    return seen;
  }
  /// Edges lost since the last call. The task's thread.
  [[nodiscard]] std::uint64_t take_lost() noexcept { return lost_.exchange(0, std::memory_order_relaxed); }
  /// Edges lost since the last take_lost(). Any thread.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }
  /// Those lost since lost() was `before` are lost no more; how many they are. The task's thread.
  [[nodiscard]] std::uint64_t take_lost_since(std::uint64_t before) noexcept {
    const std::uint64_t since = lost() - before;
    lost_.fetch_sub(since, std::memory_order_relaxed);
    return since;
  }

  ActivationGate gate;  ///< opened after runs have become due

 private:
  // A run that is due already keeps its time: the runs behind it show their wait as latency.
  void keep(Clock& clock, std::uint64_t edges, std::uint64_t bound, TimePoint now) noexcept {
    const std::uint64_t due = due_.load(std::memory_order_acquire);
    const std::uint64_t kept = due >= bound ? 0 : std::min(edges, bound - due);
    if (kept < edges) lost_.fetch_add(edges - kept, std::memory_order_relaxed);
    if (kept == 0) return;
    if (due == 0) seen_at_.store(now.time_since_epoch().count(), std::memory_order_relaxed);
    due_.fetch_add(kept, std::memory_order_acq_rel);
    gate.open(clock);
  }

  bool level_ = false;  // the poller's alone
  bool primed_ = false;
  std::uint64_t taken_ = 0;  // calls that were polled; the poller's alone
  std::atomic<std::uint64_t> raised_{0};
  std::atomic<std::uint64_t> due_{0};  // runs that have not begun
  std::atomic<Duration::rep> seen_at_{0};
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace plchost
