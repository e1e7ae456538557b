#pragma once

#include <atomic>
#include <cstdint>

#include "schedulers/clock.hpp"

namespace plchost {

/// Gives the control thread a window in which no thread runs application code. Threads wait only for that
/// window: it closes the gate, looks whether all seats are empty, and opens it again. A task that comes
/// meanwhile waits at the gate.
class CycleGate {
 public:
  /// Where one thread says that it is within. The gate outlives it.
  class Seat {
   public:
    /// Within: from here to leave(). Sleeps while the gate is closed. Real-time; the seat's own thread.
    void enter(CycleGate& gate, Clock& clock) noexcept {
      for (;;) {
        // Either the thread that has closed the gate sees this store, or the gate is seen closed here.
        taken_.store(true, std::memory_order_seq_cst);
        if (gate.closed_.load(std::memory_order_seq_cst) == 0) return;
        taken_.store(false, std::memory_order_release);
        clock.wait(gate.closed_, 1, kNoDeadline);
      }
    }
    void leave() noexcept { taken_.store(false, std::memory_order_release); }
    /// Any thread.
    [[nodiscard]] bool taken() const noexcept { return taken_.load(std::memory_order_seq_cst); }

   private:
    std::atomic<bool> taken_{false};
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

  /// Of the thread that reads event variables: there is one at a time.
  [[nodiscard]] Seat& variables() noexcept { return variables_; }
  [[nodiscard]] const Seat& variables() const noexcept { return variables_; }

  /// Control thread; open() follows soon.
  void close() noexcept { closed_.store(1, std::memory_order_seq_cst); }
  void open(Clock& clock) noexcept {
    closed_.store(0, std::memory_order_seq_cst);
    clock.wake(closed_);
  }

 private:
  std::atomic<std::uint32_t> closed_{0};
  Seat variables_;
};

}  // namespace plchost
