#include "api/server/posts/post_intent.hpp"

namespace plchost {

void PostIntent::begin(Place place, const KeptState& kept) noexcept {
  // The end of the intent before is in memory before this one is written, at a kill, too.
  std::atomic_thread_fence(std::memory_order_release);
  entry_.store(place.entry, std::memory_order_relaxed);
  next_.store(kept.other(), std::memory_order_relaxed);
  event_.store(place.event, std::memory_order_relaxed);
}

void PostIntent::write(KeptState& kept, const SourceState& after, CountedEvent::Snapshot seen) noexcept {
  kept.write(next_.load(std::memory_order_relaxed), after);
  mark_.store(seen.marked() ? 0 : 1, std::memory_order_relaxed);
  pending_.store(1, std::memory_order_release);
}

void PostIntent::end(KeptState& kept, CountedEvent& event, CountedEvent::Snapshot made) noexcept {
  kept.choose(next_.load(std::memory_order_relaxed));
  event.wake(made);
  drop();
}

// The work of steps 3 and 4 of a post, if it was made.
void PostIntent::finish_post(KeptState& kept, CountedEvent& event) noexcept {
  if (event.snapshot().marked() != (mark_.load(std::memory_order_relaxed) != 0)) return;
  kept.choose(next_.load(std::memory_order_relaxed));
  event.nudge();
}

}  // namespace plchost
