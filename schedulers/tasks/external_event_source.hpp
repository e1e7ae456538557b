#pragma once

#include <atomic>
#include <cstdint>

#include "schedulers/clock/clock.hpp"
#include "schedulers/tasks/activation.hpp"
#include "shm/base/counted_event.hpp"

namespace plchost {

/// How far an external-event task has come in its event, whatever its source is. Only the task's thread uses
/// it, but for `slept_at`.
struct EventCursor {
  CountedEvent& event;
  std::uint64_t next = 0;  ///< posts that were run or lost
  std::uint64_t seen = 0;  ///< posts that were seen at `seen_at`
  TimePoint seen_at;
  std::atomic<std::uint64_t> slept_at{0};  ///< the event's count when the task last went to sleep
};

/// An external-event task sleeps on the event's own word: no thread of ours is between the poster and the
/// task, under any scheduler. For n posts there are n runs; of a backlog beyond its bound the oldest posts
/// are dropped and counted. A count that jumps back, or ahead by 16 times the bound, was written over: that
/// is one run, and counted as lost.
class ExternalEventSource final : public ActivationSource {
 public:
  /// `max_backlog` >= 1.
  ExternalEventSource(Clock& clock, EventCursor& cursor, std::uint64_t max_backlog) noexcept
      : clock_(clock), cursor_(cursor), max_backlog_(max_backlog) {}

  [[nodiscard]] std::optional<Activation> wait() noexcept override;
  void interrupt() noexcept override;

 private:
  Clock& clock_;
  EventCursor& cursor_;
  std::uint64_t max_backlog_;
  std::atomic<bool> interrupted_{false};
};

}  // namespace plchost
