#include "schedulers/tasks/external_event_source.hpp"

namespace plchost {

namespace {

/// A backlog of so many times its bound is none, and nor is a count that went back.
constexpr std::uint64_t kImplausible = 16;

}  // namespace

std::optional<Activation> ExternalEventSource::wait() noexcept {
  EventCursor& cursor = cursor_;
  for (;;) {
    // In this order no nudge is missed: see CountedEvent::wait().
    const CountedEvent::Snapshot snapshot = cursor.event.snapshot();
    if (interrupted_.load(std::memory_order_acquire)) {
      interrupted_.store(false, std::memory_order_relaxed);
      return std::nullopt;
    }
    const std::uint64_t count = snapshot.count();
    if (count == cursor.next) {
      cursor.slept_at.store(count, std::memory_order_relaxed);
      clock_.wait(cursor.event, snapshot);
      continue;
    }
    const std::uint64_t backlog = count - cursor.next;
    if (backlog / kImplausible >= max_backlog_) {
      // A stranger wrote over the counter: the number of posts is not known.
      cursor.next = cursor.seen = count;
      cursor.seen_at = clock_.now();
      const bool back = backlog > CountedEvent::kCountMask;
      return Activation{.release = cursor.seen_at, .lost_events = back ? 1 : backlog - 1};
    }
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
  cursor_.event.nudge();
}

}  // namespace plchost
