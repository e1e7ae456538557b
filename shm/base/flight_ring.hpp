#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost {

/// The meaning of an entry of the flight recorder. `figure` is in nanoseconds unless said otherwise. The
/// numbers are part of the page's version.
enum class FlightKind : std::uint8_t {
  none = 0,       ///< no entry: memory that nobody has written
  start = 1,      ///< a cycle begins; figure: since its planned release
  end = 2,        ///< it has ended; figure: time spun ahead of it
  lost = 3,       ///< releases were lost right before the cycle that begins; figure: how many
  taken = 4,      ///< the cycle that begins is for a post; figure: the event's count
  posted = 5,     ///< the task's code has posted an external event; figure: see posted_figure()
  moved = 6,      ///< the clock regulator has moved the next release; figure: by how much
  work = 7,       ///< the runtime's own work between two cycles has ended; figure: how long it took
  halted = 8,     ///< a debugger holds the code
  resumed = 9,    ///< it goes on
  fault = 10,     ///< a task was put into exception; figure: number of the task * 256 + FaultKind
  started = 11,   ///< all tasks are released from here on
  stopping = 12,  ///< all tasks are to park
  switched = 13,  ///< the scheduler was exchanged; figure: so long that took
  held = 14,      ///< all tasks waited between two cycles, for an online change or values; figure: so long
  late = 15,      ///< the supervision, which is above all tasks, woke too late; figure: by how much
  struck = 16,    ///< a watchdog has hit; figure: number of the task * 256 + FaultKind
  polled = 17,    ///< event variables were read, which took long; figure: so long
};
[[nodiscard]] std::string_view to_string(FlightKind kind) noexcept;

/// One entry: 16 bytes in memory.
struct FlightEntry {
  static constexpr unsigned kKindBits = 8;
  static constexpr std::int64_t kMaxFigure = INT64_MAX >> kKindBits;  ///< 2 years; larger ones are cut

  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC
  FlightKind kind = FlightKind::none;
  std::int64_t figure = 0;
};

/// So many marks of events have room in an entry.
inline constexpr std::uint32_t kEventMarkMask = 0x7f'ffff;
/// Of FlightKind::posted: which event, and its count after the post.
[[nodiscard]] constexpr std::int64_t posted_figure(std::uint32_t name_mark, std::uint64_t count) noexcept {
  return static_cast<std::int64_t>((std::uint64_t{name_mark & kEventMarkMask} << 32) | (count & 0xffff'ffff));
}
/// Of FlightKind::fault and FlightKind::struck. `kind`: the number of a FaultKind.
[[nodiscard]] constexpr std::int64_t fault_figure(std::size_t task, std::uint8_t kind) noexcept {
  return static_cast<std::int64_t>(task) * 256 + kind;
}

/// A ring of the last entries of one thread, in memory that other processes may map. The writer never waits
/// and readers are never in its way: a reader finds out itself which entries were written over meanwhile. All
/// zero is valid and empty.
///
/// An entry is two words. `written` counts the entries that are whole, so the next one is written into the
/// place of entry `written - capacity`. A reader copies entries, reads the count again, and drops those
/// whose place may have been under way by then.
class FlightRing {
 public:
  using Word = std::atomic<std::uint64_t>;
  static constexpr std::size_t kWordsOfEntry = 2;

  /// None: put() does nothing.
  FlightRing() noexcept = default;
  /// `words`: kWordsOfEntry for each entry, of which there is a power of two. Goes on behind what was
  /// written.
  FlightRing(Word& written, std::span<Word> words) noexcept
      : written_(&written),
        words_(words.data()),
        mask_(words.size() / kWordsOfEntry - 1),
        count_(written.load(std::memory_order_relaxed)) {}

  /// Real-time: neither a lock nor a system call nor an allocation. One thread only.
  void put(TimePoint time, FlightKind kind, std::int64_t figure = 0) noexcept {
    if (written_ == nullptr) return;
    Word* const place = words_ + (count_ & mask_) * kWordsOfEntry;
    // Pairs with the acquire fence in read(): a reader that sees a word of this entry sees that the entry
    // before it is counted.
    std::atomic_thread_fence(std::memory_order_release);
    place[0].store(static_cast<std::uint64_t>(time.time_since_epoch().count()), std::memory_order_relaxed);
    place[1].store(packed(kind, figure), std::memory_order_relaxed);
    // The count is the writer's own: a stranger who writes over the shared one leads it nowhere.
    written_->store(++count_, std::memory_order_release);
  }

  /// The entries from number `from` on that are whole, in their order, and the number of the one that comes
  /// next. Those before `from` + `skipped` were written over.
  struct Read {
    std::vector<FlightEntry> entries;
    std::uint64_t next = 0;
    std::uint64_t skipped = 0;
  };
  /// Any thread of any process. Allocates.
  [[nodiscard]] static Read read(const Word& written, std::span<const Word> words, std::uint64_t from) {
    const std::uint64_t capacity = words.size() / kWordsOfEntry;
    const std::uint64_t end = written.load(std::memory_order_acquire);
    Read read{.entries = {}, .next = end, .skipped = 0};
    if (end <= from) return read;
    std::uint64_t first = end - from > capacity ? end - capacity : from;
    read.entries.reserve(end - first);
    for (std::uint64_t i = first; i < end; ++i) {
      const auto place = words.subspan((i & (capacity - 1)) * kWordsOfEntry, kWordsOfEntry);
      read.entries.push_back(
          unpacked(place[0].load(std::memory_order_relaxed), place[1].load(std::memory_order_relaxed)));
    }
    std::atomic_thread_fence(std::memory_order_acquire);
    const std::uint64_t now = written.load(std::memory_order_relaxed);
    // Entry `now` may be under way, in the place of the one that is a capacity older.
    const std::uint64_t whole = now >= capacity ? now - capacity + 1 : 0;
    if (whole > first) {
      const std::uint64_t gone = whole - first < end - first ? whole - first : end - first;
      read.entries.erase(read.entries.begin(), read.entries.begin() + static_cast<std::ptrdiff_t>(gone));
      first += gone;
    }
    read.skipped = first - from;
    return read;
  }

 private:
  [[nodiscard]] static std::uint64_t packed(FlightKind kind, std::int64_t figure) noexcept {
    if (figure > FlightEntry::kMaxFigure) figure = FlightEntry::kMaxFigure;
    if (figure < -FlightEntry::kMaxFigure) figure = -FlightEntry::kMaxFigure;
    return static_cast<std::uint64_t>(figure) << FlightEntry::kKindBits | static_cast<std::uint64_t>(kind);
  }
  [[nodiscard]] static FlightEntry unpacked(std::uint64_t time, std::uint64_t word) noexcept {
    return {.time_ns = static_cast<std::int64_t>(time),
            .kind = static_cast<FlightKind>(word & 0xff),
            .figure = static_cast<std::int64_t>(word) >> FlightEntry::kKindBits};
  }

  Word* written_ = nullptr;
  Word* words_ = nullptr;
  std::uint64_t mask_ = 0;
  std::uint64_t count_ = 0;
};

}  // namespace plchost
