#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "schedulers/settings/task_options.hpp"
#include "shm/base/fault_record.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The part about faults that all tasks of a set share: the finder of one raises it here, the control thread
/// waits for it on a descriptor.
class FaultBoard {
 public:
  /// `notify`: an eventfd; -1: nobody is told.
  explicit FaultBoard(int notify = -1) noexcept : notify_(notify) {}
  ~FaultBoard();
  FaultBoard(const FaultBoard&) = delete;
  FaultBoard& operator=(const FaultBoard&) = delete;
  /// Called by halt(), in any context; empty: nobody. Set-up, before any task runs.
  void tell(std::function<void()> halted) noexcept;
  /// A fault outside of the tasks ends the process: halts the board that was told last. Any context, signal
  /// handlers included.
  static void process_ends() noexcept;
  /// From now on no task begins another cycle. Any context, signal handlers included.
  void halt() noexcept {
    halted_.store(true, std::memory_order_relaxed);
    if (told_) told_();
  }
  [[nodiscard]] bool halted() const noexcept { return halted_.load(std::memory_order_relaxed); }
  /// A record is complete. Any context, signal handlers included.
  void notify() noexcept;

 private:
  int notify_;
  std::function<void()> told_;
  std::atomic<bool> halted_{false};
};

/// The fault of one task: raised once, by the first finder, and kept.
class TaskFault {
 public:
  TaskFault(FaultBoard* board, WatchdogPolicy policy) noexcept : board_(board), policy_(policy) {}

  /// Where the record is shown from publish() on, in memory that outlives this process. Set-up.
  void show_in(Seqlock<FaultRecord>* shown) noexcept { shown_ = shown; }

  /// Raises it if it was not raised before: then the caller, and only it, fills record() and calls publish().
  /// Any context, signal handlers included. `whole_application`: under any policy.
  [[nodiscard]] bool claim(bool whole_application = false) noexcept;
  [[nodiscard]] FaultRecord& record() noexcept { return record_; }
  /// Of the process only: others could name none of its functions.
  [[nodiscard]] BackTrace& back_trace() noexcept { return back_trace_; }
  [[nodiscard]] const BackTrace& back_trace() const noexcept { return back_trace_; }
  /// Shows the record as far as it is known, before anything that may end the process.
  void show() noexcept;
  void publish() noexcept;

  [[nodiscard]] bool raised() const noexcept { return state_.load(std::memory_order_relaxed) != State::none; }
  /// Null until publish(). Any thread.
  [[nodiscard]] const FaultRecord* published() const noexcept {
    return state_.load(std::memory_order_acquire) == State::published ? &record_ : nullptr;
  }
  /// The task may not begin another cycle. Any thread, real-time.
  [[nodiscard]] bool halts() const noexcept { return raised() || (board_ != nullptr && board_->halted()); }
  [[nodiscard]] WatchdogPolicy policy() const noexcept { return policy_; }

 private:
  enum class State : std::uint8_t { none, claimed, published };

  FaultBoard* board_;
  WatchdogPolicy policy_;
  std::atomic<State> state_{State::none};
  FaultRecord record_;
  BackTrace back_trace_;
  Seqlock<FaultRecord>* shown_ = nullptr;
};

/// Within a catch (...): raises the fault for the exception that is being handled. Real-time.
void raise_current_exception(TaskFault& fault, bool event_variable = false) noexcept;

/// The task has not come to the end of its cycle, or its event variable has not returned, within `limit`.
/// Raises the fault, and no task begins another cycle, whatever its policy says. Nothing happens if a fault
/// was raised before. Control thread.
void raise_stop_timeout(TaskFault& fault, StopPhase phase, Duration limit,
                        bool event_variable = false) noexcept;

}  // namespace plchost
