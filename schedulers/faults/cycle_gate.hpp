#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "schedulers/clock/clock.hpp"

namespace plchost {

/// Gives the control thread a window in which no thread runs application code. Threads wait only for that
/// window: it closes the gate, looks whether all seats are empty, and opens it again. A task that comes
/// meanwhile waits at the gate.
class CycleGate {
 public:
  /// The one place where a thread says that it is in a cycle, and in which part of it. The gate outlives it.
  class Seat {
   public:
    /// Within: from here to leave(). Sleeps while the gate is closed. Real-time; the seat's own thread.
    void enter(CycleGate& gate, Clock& clock) noexcept {
      for (;;) {
        // Either the thread that has closed the gate sees this store, or the gate is seen closed here.
        word_.store(kWithin, std::memory_order_seq_cst);
        if (gate.closed_.load(std::memory_order_seq_cst) == 0) return;
        word_.store(kOutside, std::memory_order_release);
        clock.wait(gate.closed_, 1, kNoDeadline);
      }
    }
    void leave() noexcept { word_.store(kOutside, std::memory_order_release); }
    /// Any thread.
    [[nodiscard]] bool taken() const noexcept { return word_.load(std::memory_order_seq_cst) != kOutside; }
    /// The code stands still in its middle, and the seat is empty until goes_on(). The seat's own thread,
    /// while code runs. Since when the code runs.
    [[nodiscard]] TimePoint stands_still() noexcept {
      const TimePoint start{Duration(word_.load(std::memory_order_relaxed))};
      still_.store(true, std::memory_order_relaxed);
      word_.store(kOutside, std::memory_order_release);
      return start;
    }
    /// Any thread that has found the seat empty, as long as the gate is closed.
    [[nodiscard]] bool is_still() const noexcept { return still_.load(std::memory_order_relaxed); }
    /// The code goes on, as if it had begun at `start`. Sleeps while the gate is closed. Null: there is none.
    void goes_on(CycleGate* gate, Clock& clock, TimePoint start) noexcept {
      if (gate != nullptr) enter(*gate, clock);
      still_.store(false, std::memory_order_release);
      word_.store(start.time_since_epoch().count(), std::memory_order_release);
    }

    /// Code of the application runs since `start`, or the runtime does work of its own, until part_ends().
    /// The seat's own thread, real-time.
    void code_begins(TimePoint start) noexcept { begin_part(start.time_since_epoch().count()); }
    void work_begins() noexcept { begin_part(kAtWork); }
    void part_ends() noexcept { word_.store(before_, std::memory_order_release); }
    /// Since when code of the application runs; nothing: none does. Any context.
    [[nodiscard]] std::optional<TimePoint> code_since() const noexcept {
      const auto word = word_.load(std::memory_order_acquire);
      if (word <= kWithin) return std::nullopt;
      return TimePoint(Duration(word));
    }
    /// The runtime does work of its own, or the code stands still. Any thread.
    [[nodiscard]] bool at_work() const noexcept {
      return word_.load(std::memory_order_acquire) == kAtWork || still_.load(std::memory_order_acquire);
    }

   private:
    // Above kWithin: the time since which code of the application runs.
    static constexpr Duration::rep kAtWork = -1;
    static constexpr Duration::rep kOutside = 0;
    static constexpr Duration::rep kWithin = 1;

    void begin_part(Duration::rep part) noexcept {
      before_ = word_.load(std::memory_order_relaxed);
      word_.store(part, std::memory_order_release);
    }

    std::atomic<Duration::rep> word_{kOutside};
    std::atomic<bool> still_{false};
    Duration::rep before_ = kOutside;  // the seat's own thread: the word outside of the part
  };

  /// Within, as long as it exists.
  class Stay {
   public:
    Stay(CycleGate* gate, Seat& seat, Clock& clock) noexcept : seat_(gate != nullptr ? &seat : nullptr) {
      if (gate != nullptr) seat.enter(*gate, clock);
    }
    ~Stay() {
      if (seat_ != nullptr) seat_->leave();
    }
    Stay(const Stay&) = delete;
    Stay& operator=(const Stay&) = delete;

   private:
    Seat* seat_;
  };

  /// Control thread; open() follows soon.
  void close() noexcept { closed_.store(1, std::memory_order_seq_cst); }
  void open(Clock& clock) noexcept {
    closed_.store(0, std::memory_order_seq_cst);
    clock.wake(closed_);
  }

 private:
  std::atomic<std::uint32_t> closed_{0};
};

}  // namespace plchost
