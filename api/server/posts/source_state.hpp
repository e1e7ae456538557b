#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace plchost {

/// The results of posts. received = accepted + rejected + duplicate + early + malformed.
struct PostCounters {
  std::uint64_t received = 0;
  std::uint64_t accepted = 0;
  std::uint64_t no_task = 0;  ///< of those accepted
  std::uint64_t rejected = 0;
  std::uint64_t duplicate = 0;
  std::uint64_t early = 0;      ///< not taken, because one before it was missing
  std::uint64_t lost = 0;       ///< never came, and its source went on without it
  std::uint64_t malformed = 0;  ///< with numbers or a source that cannot be: counted nowhere else

  void add(const PostCounters& other) noexcept;
};

/// How far one source has come.
struct SourceState {
  std::uint64_t last = 0;          ///< all posts up to this number are done
  std::uint64_t batch = 0;         ///< number of the batch whose events are being posted
  std::uint32_t batch_done = 0;    ///< so many of them are posted: the next server goes on there
  std::int32_t rejected_code = 0;  ///< of the post `rejected_sequence`
  std::uint64_t rejected_sequence = 0;
  std::uint64_t batch_no_task = 0;  ///< 1: one of them was taken by no task
  std::uint64_t last_count = 0;  ///< the event's count with the post `last`; 0: it was rejected, or a batch
  std::uint64_t last_taken = 0;  ///< 1: tasks took posts then
  PostCounters counters = {};
};

/// The state of a source in two places, of which one counts while the other one is written. In shared memory;
/// all zero is a source that has posted nothing.
class KeptState {
 public:
  [[nodiscard]] const SourceState& state() const noexcept {
    return states_[current_.load(std::memory_order_acquire) & 1U];
  }
  /// It is this from now on.
  void set(const SourceState& state) noexcept {
    const std::uint32_t next = other();
    write(next, state);
    choose(next);
  }

  // The two steps of it.

  /// Which of the places does not count.
  [[nodiscard]] std::uint32_t other() const noexcept {
    return 1U - (current_.load(std::memory_order_relaxed) & 1U);
  }
  void write(std::uint32_t place, const SourceState& state) noexcept {
    // The choice of the other place is in memory before this one is written, at a kill, too.
    std::atomic_thread_fence(std::memory_order_release);
    states_[place & 1U] = state;
  }
  void choose(std::uint32_t place) noexcept { current_.store(place, std::memory_order_release); }

 private:
  std::atomic<std::uint32_t> current_{0};
  std::array<SourceState, 2> states_{};
};

}  // namespace plchost
