#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "instances/plc_debug.h"
#include "instances/runtime/debug/breakpoint.hpp"
#include "instances/runtime/debug/step_rule.hpp"
#include "instances/runtime/debug/table_hold.hpp"
#include "schedulers/tasks/task.hpp"

namespace plchost {

/// Why a task halts.
enum class HaltReason : std::uint8_t { breakpoint, step, pause };

/// The part that the threads of all tasks of a debug build share.
struct DebugBoard {
  std::atomic<const BreakpointTable*> table{nullptr};
  std::atomic<bool> suspended{true};  ///< no task halts, and those that halt go on
  int notify = -1;                    ///< an eventfd that is written when a task halts
};

/// One task of a debug build: its thread halts here, and the control thread lets it go.
class DebugTask {
 public:
  static constexpr std::size_t kLogHits = 64;

  /// Both outlive it.
  DebugTask(Task& task, DebugBoard& board) noexcept : task_(task), board_(board) {}

  /// The task's thread comes to a statement. `marker`: the place in the code from which this is called, which
  /// tells statements of one line apart. Real-time unless it halts.
  void statement(Plc_Frame& frame, const void* marker, std::uint64_t cycle) noexcept;
  /// A call of the task's thread returns. Real-time.
  void leave(const Plc_Frame& frame) noexcept {
    if (steps()) step_.leaves(frame);
  }

  // All that follows: the control thread.
  [[nodiscard]] Task& task() const noexcept { return task_; }
  /// It halts at its next statement.
  void pause() noexcept { pause_.store(true, std::memory_order_relaxed); }
  /// A pause or a step that is under way ends where the task stands. False: there was none.
  bool forget_steps() noexcept {
    const bool paused = pause_.exchange(false, std::memory_order_relaxed);
    return stepping_.exchange(false, std::memory_order_relaxed) || paused;
  }
  [[nodiscard]] bool is_to_pause() const noexcept { return pause_.load(std::memory_order_relaxed); }
  /// Breakpoints, steps and pauses of its statements are ignored from now on, or not any more.
  void ignore(bool ignored) noexcept { ignored_.store(ignored, std::memory_order_relaxed); }
  [[nodiscard]] bool ignored() const noexcept { return ignored_.load(std::memory_order_relaxed); }

  /// Where it halts: valid until it is let go.
  struct Halt {
    const Plc_Frame* frame = nullptr;
    const void* marker = nullptr;  ///< of the statement
    std::uint64_t cycle = 0;
    HaltReason reason{};
    std::uint32_t breakpoint = 0;  ///< its id
    std::uint64_t number = 0;      ///< of the halts of this task, from 1
    TimePoint since{};
    Duration before{};  ///< earlier halts of the same cycle
  };
  /// Nothing: it does not halt.
  [[nodiscard]] std::optional<Halt> halt() const noexcept;
  [[nodiscard]] bool steps() const noexcept { return stepping_.load(std::memory_order_relaxed); }
  /// It is to go on; only while it halts. rouse() follows.
  void let_go(const StepRule& step) noexcept;
  /// It goes on, if it was let go or the tasks are suspended.
  void rouse() noexcept;
  [[nodiscard]] std::uint64_t halts() const noexcept { return halts_.load(std::memory_order_relaxed); }
  /// In all halts that are over.
  [[nodiscard]] Duration halted_for() const noexcept {
    return Duration(halted_ns_.load(std::memory_order_relaxed));
  }
  /// It may be looking at that table.
  [[nodiscard]] bool looks_at(const BreakpointTable* table) const noexcept { return table_.holds(table); }
  /// The hits of log points since the last call.
  void take_logs(const std::function<void(const LogHit&)>& with);
  [[nodiscard]] std::uint64_t take_lost_logs() noexcept {
    return lost_logs_.exchange(0, std::memory_order_relaxed);
  }

 private:
  [[nodiscard]] std::uint32_t look_at_breakpoints(const Plc_Frame& frame) noexcept;
  void note(const Breakpoint& breakpoint, const Plc_Frame& frame) noexcept;
  void stop_here(const Halt& halt) noexcept;

  Task& task_;
  DebugBoard& board_;
  std::atomic<bool> pause_{false};
  std::atomic<bool> ignored_{false};
  std::atomic<bool> stepping_{false};
  StepRule step_;                         // written by the control thread while the task halts, else its own
  std::atomic<std::uint32_t> gate_{0};    // the thread sleeps on it: it changes when the task may go on
  std::atomic<std::uint64_t> halted_{0};  // the gate on which it sleeps, and 1; 0: it does not halt
  Halt halt_;
  std::uint64_t halted_cycle_ = 0;  // of the last halt; the thread's own
  Duration halted_in_cycle_{};
  std::atomic<std::uint64_t> halts_{0};
  std::atomic<std::int64_t> halted_ns_{0};
  TableHold<BreakpointTable> table_;
  std::array<LogHit, kLogHits> logs_{};  // a ring of one writer and one reader
  std::atomic<std::uint64_t> logged_{0};
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<std::uint64_t> lost_logs_{0};
};

}  // namespace plchost
