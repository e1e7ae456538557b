#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <utility>

#include "api/server/posts/source_state.hpp"
#include "shm/base/counted_event.hpp"

namespace plchost {

/// The post that is being made, so that a post and what is kept of its source are one step, whichever
/// instruction a kill hits. In shared memory; all zero is none. One for all sources, since posts are made one
/// after the other, by one process at a time:
///
///   1. The new state of the source is written beside the one that counts, then the intent: which source,
///      which event, and the mark that the event will have.
///   2. One compare-exchange counts the post and changes the event's mark.
///   3. One store makes the new state count.
///   4. Waiting tasks are woken, and the intent is cleared.
///
/// If an intent is left, the next process compares the marks. If the post was made, it does 3 and 4; both do
/// no harm when they were done before. If not, nothing has happened, and the client repeats the post. Other
/// posters change the count at any time, but never the mark.
class PostIntent {
 public:
  /// Where the next process finds what the post is about.
  struct Place {
    std::uint32_t entry;  ///< of the source, in the ledger
    std::uint32_t event;  ///< in the pool
  };

  /// Posts to the event that `find()` gives, and keeps what `after(seen)` returns, in one step. `find()`:
  /// null if the event may not be posted to (any more). `seen`: the event just before the post. Returns the
  /// event with the post; nothing: it may not be posted to, and nothing was done.
  template <class Find, class After>
  [[nodiscard]] std::optional<CountedEvent::Snapshot> post(Place place, KeptState& kept, Find find,
                                                           After after) {
    begin(place, kept);
    while (CountedEvent* const event = find()) {
      CountedEvent::Snapshot seen = event->snapshot();
      write(kept, after(std::as_const(seen)), seen);
      if (!event->post_marked(seen)) continue;
      end(kept, *event, seen);
      return seen;
    }
    drop();
    return std::nullopt;
  }

  /// Does what a killed process has left to do. `kept_of(entry)` and `event_at(event)`: null if there is
  /// none.
  template <class KeptOf, class EventAt>
  void finish(KeptOf kept_of, EventAt event_at) noexcept {
    if (pending_.load(std::memory_order_acquire) != 0) {
      KeptState* const kept = kept_of(entry_.load(std::memory_order_relaxed));
      CountedEvent* const event = event_at(event_.load(std::memory_order_relaxed));
      if (kept != nullptr && event != nullptr) finish_post(*kept, *event);
    }
    drop();
  }
  /// Forgets a post that is not of this pool.
  void drop() noexcept { pending_.store(0, std::memory_order_release); }

 private:
  void begin(Place place, const KeptState& kept) noexcept;
  void write(KeptState& kept, const SourceState& after, CountedEvent::Snapshot seen) noexcept;
  void end(KeptState& kept, CountedEvent& event, CountedEvent::Snapshot made) noexcept;
  void finish_post(KeptState& kept, CountedEvent& event) noexcept;

  std::atomic<std::uint32_t> pending_{0};  // 1: the rest counts; written last
  std::atomic<std::uint32_t> entry_{0};
  std::atomic<std::uint32_t> next_{0};  // of the two places of the state: counts once the post is made
  std::atomic<std::uint32_t> event_{0};
  std::atomic<std::uint32_t> mark_{0};  // of the event once the post is made
};

}  // namespace plchost
