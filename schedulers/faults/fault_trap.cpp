#include "schedulers/faults/fault_trap.hpp"

#include <cerrno>
#include <csignal>
#include <utility>

#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <ucontext.h>
#include <unistd.h>

#include "schedulers/faults/processor_guard.hpp"
#include "schedulers/faults/stack_walk.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"
#include "shm/guard/memory_guard.hpp"

namespace plchost {

namespace {

constinit thread_local FaultTrap* armed = nullptr;
constinit thread_local pid_t own_thread = 0;
constinit std::atomic<bool> installed{false};
constinit std::atomic<FaultBoard*> telling{nullptr};

int watchdog_signal() noexcept {
  return SIGRTMAX - 1;
}

// The guard below a stack refuses what comes next to its end: a call, or the first use of an array.
bool is_near_stack(std::uintptr_t address, const ucontext_t& context) noexcept {
  constexpr std::uintptr_t kNear = 64U << 10U;
#if defined(__x86_64__)
  const auto stack = static_cast<std::uintptr_t>(context.uc_mcontext.gregs[REG_RSP]);
#elif defined(__aarch64__)
  const std::uintptr_t stack = context.uc_mcontext.sp;
#else
  (void)context;
  const std::uintptr_t stack = 0;
#endif
  return address + kNear >= stack && address <= stack + kNear;
}

// Of a jump to where no code is: the instruction after the call. A stack that cannot be read says nothing.
std::uintptr_t caller_of(const ucontext_t& context) noexcept {
#if defined(__x86_64__)
  std::uintptr_t found = 0;
  const auto stack = static_cast<std::uintptr_t>(context.uc_mcontext.gregs[REG_RSP]);
  const iovec to{.iov_base = &found, .iov_len = sizeof found};
  // NOLINTNEXTLINE(performance-no-int-to-ptr): it is an address
  const iovec from{.iov_base = reinterpret_cast<void*>(stack), .iov_len = sizeof found};
  return ::process_vm_readv(::getpid(), &to, 1, &from, 1, 0) == ssize_t{sizeof found} ? found : 0;
#elif defined(__aarch64__)
  return context.uc_mcontext.regs[30];
#else
  (void)context;
  return 0;
#endif
}

// As if there were no handler. A fault of the processor comes back by itself when the handler returns. A
// signal that was sent is sent again, and so is that of a breakpoint, behind which the thread would go on.
void crash(int signal, const siginfo_t& info) noexcept {
  struct sigaction action{};
  action.sa_handler = SIG_DFL;
  ::sigaction(signal, &action, nullptr);
  if (info.si_code <= 0 || signal == SIGTRAP) ::syscall(SYS_tgkill, ::getpid(), ::gettid(), signal);
}

}  // namespace

FaultBoard::~FaultBoard() {
  FaultBoard* self = this;
  telling.compare_exchange_strong(self, nullptr, std::memory_order_acq_rel);
}

void FaultBoard::tell(std::function<void()> halted) noexcept {
  told_ = std::move(halted);
  if (told_) telling.store(this, std::memory_order_release);
}

void FaultBoard::process_ends() noexcept {
  if (FaultBoard* const board = telling.load(std::memory_order_acquire)) board->halt();
}

void FaultBoard::notify() noexcept {
  const std::uint64_t one = 1;
  if (notify_ >= 0) (void)!::write(notify_, &one, sizeof one);  // fails only if it is readable already
}

bool TaskFault::claim(bool whole_application) noexcept {
  State none = State::none;
  if (!state_.compare_exchange_strong(none, State::claimed, std::memory_order_acq_rel)) return false;
  if (board_ != nullptr && (whole_application || policy_ == WatchdogPolicy::application)) board_->halt();
  record_.whole_application = board_ != nullptr && board_->halted();
  record_.unix_ns = unix_time_ns();
  return true;
}

void TaskFault::show() noexcept {
  if (shown_ != nullptr) shown_->write(record_);
}

void TaskFault::publish() noexcept {
  // First: the control thread may never get to write it down.
  show();
  state_.store(State::published, std::memory_order_release);
  if (board_ != nullptr) board_->notify();
}

// Never a part of its caller: it needs the place where that one's stack ends.
[[gnu::noinline]] void FaultTrap::arm(TaskFault& fault, TimePoint start, bool event_variable) noexcept {
  bottom_ = reinterpret_cast<std::uintptr_t>(__builtin_dwarf_cfa());
  if (own_thread == 0) own_thread = ::gettid();
  thread_.store(own_thread, std::memory_order_relaxed);
  event_variable_ = event_variable;
  fault_.store(&fault, std::memory_order_relaxed);
  seat_.code_begins(start);
  armed = this;
  std::atomic_signal_fence(std::memory_order_seq_cst);
}

void FaultTrap::disarm() noexcept {
  std::atomic_signal_fence(std::memory_order_seq_cst);
  armed = nullptr;
  seat_.part_ends();
}

const FaultTrap* FaultTrap::here() noexcept {
  return armed;
}

void FaultTrap::throw_leaves() noexcept {
  if (armed != nullptr) StackWalk::walk_throw(armed->thrown_, armed->bottom_);
}

BackTrace FaultTrap::take_thrown() noexcept {
  return armed != nullptr ? std::exchange(armed->thrown_, {}) : BackTrace{};
}

void FaultTrap::strike(TimePoint since, FaultKind kind, std::int64_t figure, std::int64_t limit) noexcept {
  struck_figure_.store(figure, std::memory_order_relaxed);
  struck_kind_.store(kind, std::memory_order_relaxed);
  struck_limit_.store(limit, std::memory_order_relaxed);
  struck_.store(since.time_since_epoch().count(), std::memory_order_release);
  ::syscall(SYS_tgkill, ::getpid(), thread_.load(std::memory_order_relaxed), watchdog_signal());
}

void FaultTrap::fill_struck(FaultRecord& record) const noexcept {
  record.kind = struck_kind_.load(std::memory_order_relaxed);
  record.figure = struck_figure_.load(std::memory_order_relaxed);
  record.limit = struck_limit_.load(std::memory_order_relaxed);
}

/// The code in signal context uses only atomics, system calls, the memory of the trap's task, and StackWalk.
struct FaultHandlers {
  static void on_fault(int signal, siginfo_t* info, void* context) noexcept {
    const int saved = errno;
    StackWalk::interrupted();
    // A stranger's damage to a shared memory is not the application's fault, and no cause of an end.
    if (signal == SIGBUS && info->si_code == BUS_ADRERR && MemoryGuard::mend(info->si_addr)) {
      errno = saved;
      return;
    }
    // A process that the application has forked in a cycle ends as any other.
    if (armed == nullptr || own_thread != ::gettid()) {
      FaultBoard::process_ends();
      crash(signal, *info);
      errno = saved;
      return;
    }
    FaultTrap& trap = *armed;
    if (TaskFault& fault = *trap.fault(); fault.claim(trap.event_variable_)) {
      fill(fault.record(), trap, context);
      FaultRecord& record = fault.record();
      record.kind = FaultKind::signal;
      record.signal = signal;
      record.signal_code = info->si_code;
      // An address that is none, as the processor sees it, is not told: SI_KERNEL.
      if (info->si_code > 0 && info->si_code != SI_KERNEL)
        record.memory_address = reinterpret_cast<std::uintptr_t>(info->si_addr);
      record.stack_overflow = signal == SIGSEGV && info->si_code == SEGV_ACCERR &&
                              is_near_stack(record.memory_address, *static_cast<const ucontext_t*>(context));
      const bool no_code =
          signal == SIGSEGV && info->si_code != SI_KERNEL && record.memory_address == record.address;
      if (no_code) record.caller = caller_of(*static_cast<const ucontext_t*>(context));
      trace(fault, trap, context);
      park(trap, fault);
    }
    park(trap);
  }

  static void on_watchdog(int, siginfo_t*, void* context) noexcept {
    if (armed == nullptr) return;  // the cycle has ended in the meantime
    FaultTrap& trap = *armed;
    const auto started = trap.running_since();
    const TimePoint struck{Duration(trap.struck_.load(std::memory_order_acquire))};
    if (started != struck) return;
    if (TaskFault& fault = *trap.fault(); fault.claim(trap.event_variable_)) {
      fill(fault.record(), trap, context);
      trap.fill_struck(fault.record());
      trace(fault, trap, context);
      park(trap, fault);
    }
    park(trap);
  }

 private:
  static void fill(FaultRecord& record, const FaultTrap& trap, const void* context) noexcept {
    record.in_event_variable = trap.event_variable_;
    record.address = instruction_of(*static_cast<const ucontext_t*>(context));
  }

  static void trace(TaskFault& fault, const FaultTrap& trap, void* context) noexcept {
    fault.show();  // the walk may end the process
    StackWalk::walk(fault.back_trace(), *static_cast<ucontext_t*>(context), trap.bottom_,
                    fault.record().caller);
  }

  // All signals are blocked in the handlers, so nothing brings the thread back.
  [[noreturn]] static void park(FaultTrap& trap) noexcept {
    trap.parked_.store(true, std::memory_order_release);
    for (;;) ::pause();
  }
  [[noreturn]] static void park(FaultTrap& trap, TaskFault& fault) noexcept {
    trap.parked_.store(true, std::memory_order_release);  // before anybody is told
    fault.publish();
    for (;;) ::pause();
  }
};

Result<void> install_fault_handlers() {
  StackWalk::prepare();
  struct sigaction action{};
  action.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_RESTART;
  ::sigfillset(&action.sa_mask);
  action.sa_sigaction = &FaultHandlers::on_fault;
  for (const int signal : kFaultSignals) {
    PLCHOST_TRY(check_errno(::sigaction(signal, &action, nullptr), "cannot catch " + signal_name(signal)));
  }
  action.sa_sigaction = &FaultHandlers::on_watchdog;
  PLCHOST_TRY(
      check_errno(::sigaction(watchdog_signal(), &action, nullptr), "cannot catch the watchdog's signal"));
  installed.store(true, std::memory_order_release);
  return ProcessorGuard::install();
}

// The watchdog's signal without its order does nothing but that.
void rouse(const Thread& thread) noexcept {
  if (installed.load(std::memory_order_acquire)) thread.send(watchdog_signal());
}

}  // namespace plchost
