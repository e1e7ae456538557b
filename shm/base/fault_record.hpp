#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "shm/base/names.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The fault that put a task into exception.
enum class FaultKind : std::uint8_t {
  signal,                ///< SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP or SIGABRT in a cycle
  cpp_exception,         ///< a C++ exception left the cycle
  task_watchdog,         ///< one cycle took longer than the watchdog's time x sensitivity
  consecutive_overruns,  ///< as many cycles in a row as its sensitivity took longer than the watchdog's time
  omitted_cycles,        ///< so many releases in a row passed without a cycle
  processor_load,        ///< the instance used more of its core than it may
  stop_timeout,          ///< the cycle did not end in the time that a stop allows
  no_processor,          ///< a thread that the application has made kept the processor from the task
};
/// The words of the contract: ExceptionStatus.kind.
[[nodiscard]] std::string_view to_string(FaultKind kind) noexcept;

/// The phase that was over when a task had not come to the end of its cycle.
enum class StopPhase : std::uint8_t {
  outputs,       ///< the first phase of a stop: tasks that drive outputs
  others,        ///< its second phase: all others
  single_cycle,  ///< a single cycle of all tasks
};

/// The functions that a thread was in when it was stopped.
struct BackTrace {
  static constexpr std::size_t kMost = 32;
  /// Why there are no more.
  enum class End : std::uint8_t {
    none,     ///< there is none at all: nothing has stopped the thread within its code
    whole,    ///< the last one is the first that the runtime has called
    deep,     ///< there are more than kMost
    lost,     ///< the caller of the last one is not known
    damaged,  ///< the stack leads to memory that cannot be read
  };
  std::array<std::uint64_t, kMost> addresses{};  ///< of the instruction or throw, then of calls: behind each
  std::uint8_t count = 0;
  End end = End::none;
};
/// "only the innermost 32 functions are known"; empty: it is whole.
[[nodiscard]] std::string describe_end(const BackTrace& trace);

/// One fault, as it was found, in shared memory, too. Filled by its finder, also from within a signal
/// handler: so no texts are made here, see describe_fault().
struct FaultRecord {
  static constexpr std::size_t kMaxText = 199;

  FaultKind kind = FaultKind::signal;
  std::uint8_t in_event_variable = 0;  ///< while the scheduler read the task's BOOL, not in its cycle
  std::uint8_t stack_overflow = 0;     ///< SIGSEGV just where the stack ended
  std::uint8_t whole_application = 0;  ///< 0: only the task was stopped
  std::uint8_t not_caught = 0;         ///< a watchdog struck its thread, and it ran on
  std::int32_t signal = 0;             ///< 0 if it was none
  std::int32_t signal_code = 0;        ///< si_code
  std::uint64_t address = 0;           ///< of the instruction, or behind a throw; 0 if not known
  std::uint64_t caller = 0;  ///< the origin of a jump to `address` if no code is there; 0 if not known
  std::uint64_t memory_address = 0;      ///< the address of SIGSEGV and SIGBUS
  std::int64_t figure = 0;               ///< the watchdog's measure: ns, cycles or percent, by kind
  std::int64_t limit = 0;                ///< the most that it may be, in the same unit
  std::int64_t count = 0;                ///< consecutive_overruns: how many
  StopPhase phase = StopPhase::outputs;  ///< stop_timeout: the phase that was over
  std::int64_t unix_ns = 0;              ///< CLOCK_REALTIME
  FixedText<kMaxText> text;              ///< cpp_exception: its what(); no_processor: the thread
  FixedText<kMaxText> type;              ///< cpp_exception: the name of its type as the compiler mangles it
};

/// When a fault of this CLOCK_REALTIME was found, by the clock of the tasks, unless the former was set since.
/// Any number is allowed, as it may lie in shared memory. Any context.
[[nodiscard]] TimePoint time_of_fault(std::int64_t unix_ns) noexcept;
/// In words: the cause, with its figures. Without addresses, which only the process can name.
[[nodiscard]] std::string describe_fault(const FaultRecord& record);
/// "SIGSEGV"; "signal 40" if it has no name here.
[[nodiscard]] std::string signal_name(int signal);

}  // namespace plchost
