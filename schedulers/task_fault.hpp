#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

#include "schedulers/task_config.hpp"
#include "shm/base/names.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// What put a task into exception.
enum class FaultKind : std::uint8_t {
  signal,                ///< SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP or SIGABRT in a cycle
  cpp_exception,         ///< a C++ exception left the cycle
  task_watchdog,         ///< one cycle took longer than the watchdog's time x sensitivity
  consecutive_overruns,  ///< as many cycles in a row as its sensitivity took longer than the watchdog's time
  omitted_cycles,        ///< so many releases in a row passed without a cycle
  processor_load,        ///< the instance used more of its core than it may
  stop_timeout,          ///< the cycle did not end in the time that a stop allows
};
[[nodiscard]] std::string_view to_string(FaultKind kind) noexcept;

/// What was over when a task had not come to the end of its cycle.
enum class StopPhase : std::uint8_t {
  outputs,       ///< the first phase of a stop: tasks that drive outputs
  others,        ///< its second phase: all others
  single_cycle,  ///< a single cycle of all tasks
};

/// One fault, as it was found. Filled by who finds it, also from within a signal handler: so no texts are
/// made here, see describe_fault().
struct FaultRecord {
  static constexpr std::size_t kMaxText = 199;

  FaultKind kind = FaultKind::signal;
  bool in_event_variable = false;        ///< while the scheduler read the task's BOOL, not in its cycle
  bool stack_overflow = false;           ///< SIGSEGV just where the stack ended
  int signal = 0;                        ///< 0 if it was none
  int signal_code = 0;                   ///< si_code
  std::uintptr_t address = 0;            ///< of the instruction; 0 if not known
  std::uintptr_t caller = 0;             ///< who jumped to `address` if no code is there; 0 if not known
  std::uintptr_t memory_address = 0;     ///< what SIGSEGV and SIGBUS were about
  std::int64_t figure = 0;               ///< the watchdog's measure: ns, cycles or percent, by kind
  std::int64_t limit = 0;                ///< what it may be at most, in the same unit
  std::int64_t count = 0;                ///< consecutive_overruns: how many
  StopPhase phase = StopPhase::outputs;  ///< stop_timeout: what was over
  std::int64_t unix_ns = 0;              ///< CLOCK_REALTIME
  FixedText<kMaxText> text;              ///< cpp_exception: its what()
  FixedText<kMaxText> type;              ///< cpp_exception: the name of its type as the compiler mangles it
};

/// What all tasks of a set share about faults: whoever finds one raises it here, the control thread waits for
/// it on a descriptor.
class FaultBoard {
 public:
  /// `notify`: an eventfd; -1: nobody is told.
  explicit FaultBoard(int notify = -1) noexcept : notify_(notify) {}
  /// From now on no task begins another cycle. Any context, signal handlers included.
  void halt() noexcept { halted_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool halted() const noexcept { return halted_.load(std::memory_order_relaxed); }
  /// A record is complete. Any context, signal handlers included.
  void notify() noexcept;

 private:
  int notify_;
  std::atomic<bool> halted_{false};
};

/// The fault of one task: raised once, by whoever is first, and kept.
class TaskFault {
 public:
  TaskFault(FaultBoard* board, WatchdogPolicy policy) noexcept : board_(board), policy_(policy) {}

  /// Raises it if it was not raised before: then the caller, and only it, fills record() and calls publish().
  /// Any context, signal handlers included. `whole_application`: whatever the policy says.
  [[nodiscard]] bool claim(bool whole_application = false) noexcept;
  [[nodiscard]] FaultRecord& record() noexcept { return record_; }
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
};

/// Within a catch (...): raises the fault for the exception that is being handled. Real-time.
void raise_current_exception(TaskFault& fault, bool event_variable = false) noexcept;

/// The task has not come to the end of its cycle, or its event variable has not returned, within `limit`:
/// raises the fault, and whatever its policy says no task begins another cycle. Nothing happens if a fault
/// was raised before. Control thread.
void raise_stop_timeout(TaskFault& fault, StopPhase phase, Duration limit,
                        bool event_variable = false) noexcept;

/// In words: what happened, with its figures. Without addresses, which only the process can name.
[[nodiscard]] std::string describe_fault(const FaultRecord& record);
/// "SIGSEGV"; "signal 40" if it has no name here.
[[nodiscard]] std::string signal_name(int signal);

}  // namespace plchost
