#include "schedulers/activation/external_event_source.hpp"

namespace plchost {

std::optional<Activation> ExternalEventSource::wait() noexcept {
  EventCursor& cursor = task_.cursor();
  for (;;) {
    // In this order no nudge is missed: see CountedEvent::wait().
    const CountedEvent::Snapshot snapshot = task_.event().snapshot();
    if (interrupted_.load(std::memory_order_acquire)) {
      interrupted_.store(false, std::memory_order_relaxed);
      return std::nullopt;
    }
    const std::uint64_t count = snapshot.count();
    if (count == cursor.next) {
      clock_.wait(task_.event(), snapshot);
      continue;
    }
    const std::uint64_t backlog = count - cursor.next;
    const std::uint64_t lost = backlog > max_backlog_ ? backlog - max_backlog_ : 0;
    cursor.next += lost + 1;
    if (cursor.next > cursor.seen) {
      cursor.seen = count;
      cursor.seen_at = clock_.now();
    }
    return Activation{.release = cursor.seen_at, .lost_events = lost};
  }
}

void ExternalEventSource::interrupt() noexcept {
  interrupted_.store(true, std::memory_order_release);
  task_.event().nudge();
}

}  // namespace plchost
