#pragma once

#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <optional>

#include <sys/types.h>
#include <ucontext.h>

#include "schedulers/faults/cycle_gate.hpp"
#include "schedulers/faults/task_fault.hpp"
#include "shm/base/result.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// The signals by which code ends that has a fault.
inline constexpr std::array kFaultSignals = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT};

/// The address of the instruction that a signal came in; 0: it is not known on this processor. Signal
/// context.
[[nodiscard]] inline std::uintptr_t instruction_of(const ucontext_t& context) noexcept {
#if defined(__x86_64__)
  return static_cast<std::uintptr_t>(context.uc_mcontext.gregs[REG_RIP]);
#elif defined(__aarch64__)
  return context.uc_mcontext.pc;
#else
  (void)context;
  return 0;
#endif
}

/// One thread that runs an application's code. It says for which task it does so now and since when, catches
/// the faults of that code, and lets a watchdog stop it in the middle. A thread that is caught is parked
/// where it stands, for good: its state is kept for diagnosis, and nothing of it is undone.
class FaultTrap {
 public:
  /// From now on this thread runs code of the task whose fault this is: functions that the caller calls.
  /// Real-time; the trap's own thread.
  void arm(TaskFault& fault, TimePoint start, bool event_variable = false) noexcept;
  /// The same, for the next one of several tasks that are looked at in one go.
  void change(TaskFault& fault) noexcept { fault_.store(&fault, std::memory_order_relaxed); }
  void disarm() noexcept;

  /// The calling thread runs code of a task. Any context.
  [[nodiscard]] static bool armed_here() noexcept { return here() != nullptr; }
  /// The one under which the calling thread runs code of a task; null: it runs none. Any context.
  [[nodiscard]] static const FaultTrap* here() noexcept;
  /// For ThrowProbe: a C++ exception leaves the code that the calling thread runs, and the functions that
  /// have thrown it are still on the stack. Nothing happens if it runs none. Real-time.
  static void throw_leaves() noexcept;
  /// The functions that throw_leaves() has found last, taken once: there are none then. Real-time; the trap's
  /// own thread.
  [[nodiscard]] static BackTrace take_thrown() noexcept;
  /// Since when the code runs that is running now. Any thread.
  [[nodiscard]] std::optional<TimePoint> running_since() const noexcept { return seat_.code_since(); }
  /// Where the thread says that it is in a cycle. Any thread.
  [[nodiscard]] CycleGate::Seat& seat() noexcept { return seat_; }
  [[nodiscard]] const CycleGate::Seat& seat() const noexcept { return seat_; }
  [[nodiscard]] TaskFault* fault() const noexcept { return fault_.load(std::memory_order_relaxed); }

  /// Stops the code that runs since `since`, in its middle, with a record of this kind, figure and limit.
  /// Nothing happens if it has ended by then. The supervision's thread.
  void strike(TimePoint since, FaultKind kind, std::int64_t figure, std::int64_t limit) noexcept;

  /// The thread that is or was here; 0: none yet. Any thread.
  [[nodiscard]] pid_t thread() const noexcept { return thread_.load(std::memory_order_relaxed); }
  /// The arguments of strike(). Any thread.
  void fill_struck(FaultRecord& record) const noexcept;

  /// The thread was caught and will never go on. Any thread.
  [[nodiscard]] bool parked() const noexcept { return parked_.load(std::memory_order_acquire); }

 private:
  friend struct FaultHandlers;

  std::atomic<TaskFault*> fault_{nullptr};
  CycleGate::Seat seat_;
  std::atomic<pid_t> thread_{0};
  std::atomic<bool> parked_{false};
  bool event_variable_ = false;
  BackTrace thrown_;
  std::uintptr_t bottom_ = 0;  // the stack pointer of the function that has called arm()
  // The order of strike(); written before the signal is sent.
  std::atomic<Duration::rep> struck_{0};
  std::atomic<FaultKind> struck_kind_{FaultKind::task_watchdog};
  std::atomic<std::int64_t> struck_figure_{0};
  std::atomic<std::int64_t> struck_limit_{0};
};

/// Catches SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP and SIGABRT of this process in code under an armed
/// trap; anywhere else they do what they did. A SIGBUS in memory under a MemoryGuard is mended. Takes
/// SIGRTMAX - 1, too, with which a watchdog stops a cycle, and SIGXCPU: see ProcessorGuard. Once, before
/// there are other threads. Set-up.
[[nodiscard]] Result<void> install_fault_handlers();

/// Makes the thread leave its sleep on a futex and look at the word again. Nothing happens if the handlers
/// are not installed. Set-up.
void rouse(const Thread& thread) noexcept;

}  // namespace plchost
