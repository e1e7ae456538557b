#include "schedulers/faults/processor_guard.hpp"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include "schedulers/faults/fault_trap.hpp"
#include "shm/base/system_call.hpp"

namespace plchost {

namespace {

enum class Mailbox : std::uint8_t { empty, claimed, full };

constinit std::atomic<bool> guarded{false};  // the handler is installed
constinit std::atomic<Duration::rep> guard_limit{0};
constinit std::atomic<Duration::rep> last_sign{0};
constinit std::atomic<pid_t> signer{0};      // the thread of that sign
constinit std::atomic<bool> sets_up{false};  // the signer does
constinit std::atomic<Mailbox> mailbox{Mailbox::empty};
constinit ProcessorGuard::Taker reported;  // belongs to the thread that has made the mailbox `claimed` or
                                           // found it `full`

// The kernel raises the limit with each signal that it sends.
void set_limit(Duration limit) noexcept {
  rlimit now{};
  if (::getrlimit(RLIMIT_RTTIME, &now) != 0) return;
  const auto us = static_cast<rlim_t>(std::chrono::duration_cast<std::chrono::microseconds>(limit).count());
  const rlim_t wanted = limit == Duration::zero() || us > now.rlim_max ? now.rlim_max : us;
  if (now.rlim_cur == wanted) return;
  now.rlim_cur = wanted;
  ::setrlimit(RLIMIT_RTTIME, &now);  // cannot fail: not above the hard limit
}

// One that was bound to other cores than the thread that sets up takes nothing from it.
bool runs_beside(pid_t thread) noexcept {
  cpu_set_t here;
  cpu_set_t there;
  CPU_ZERO(&here);
  CPU_ZERO(&there);
  if (::sched_getaffinity(0, sizeof here, &here) != 0 ||
      ::sched_getaffinity(thread, sizeof there, &there) != 0)
    return false;
  cpu_set_t both;
  CPU_AND(&both, &here, &there);
  return CPU_EQUAL(&both, &there) != 0;
}

// The control thread, or the supervision, waits for the processor. A thread that sleeps is kept from its sign
// by something else.
bool runtime_starves(Duration limit, Duration silent) noexcept {
  constexpr int kSigns = 4;  // at least so many belong into the limit
  return silent > limit / kSigns && !linux_processor_times().sleeps(signer.load(std::memory_order_relaxed));
}

// In the thread that has run for so long, unless it blocks the signal: then in any other.
void on_long_run(int) noexcept {
  const int saved = errno;
  const Duration limit(guard_limit.load(std::memory_order_relaxed));
  const Duration silent =
      MonotonicClock::now() - TimePoint(Duration(last_sign.load(std::memory_order_relaxed)));
  const bool taken = sets_up.load(std::memory_order_relaxed)
                         ? runs_beside(signer.load(std::memory_order_relaxed))
                         : runtime_starves(limit, silent);
  // How long a cycle may take is for the watchdogs to say.
  if (limit > Duration::zero() && taken && !FaultTrap::armed_here()) {
    const ThreadText who = linux_processor_times().demote(::gettid());
    if (!who.view().empty()) ProcessorGuard::report(who, silent);
  }
  errno = saved;
}

}  // namespace

Result<void> ProcessorGuard::install() {
  (void)linux_processor_times();  // not for the first time in the handler
  struct sigaction action{};
  action.sa_flags = SA_ONSTACK | SA_RESTART;
  ::sigfillset(&action.sa_mask);
  action.sa_handler = &on_long_run;
  PLCHOST_TRY(check_errno(::sigaction(SIGXCPU, &action, nullptr), "cannot catch SIGXCPU"));
  guarded.store(true, std::memory_order_release);
  return {};
}

void ProcessorGuard::watch(Duration limit) noexcept {
  if (!guarded.load(std::memory_order_acquire)) return;
  sets_up.store(false, std::memory_order_relaxed);
  guard_limit.store(limit.count(), std::memory_order_relaxed);
  alive();
}

void ProcessorGuard::watch_set_up(Duration limit) noexcept {
  watch(limit);
  sets_up.store(guarded.load(std::memory_order_acquire), std::memory_order_relaxed);
}

void ProcessorGuard::alive() noexcept {
  if (!guarded.load(std::memory_order_acquire)) return;
  signer.store(::gettid(), std::memory_order_relaxed);
  last_sign.store(MonotonicClock::now().time_since_epoch().count(), std::memory_order_relaxed);
  set_limit(Duration(guard_limit.load(std::memory_order_relaxed)));
}

void ProcessorGuard::report(const ThreadText& who, Duration lasted) noexcept {
  Mailbox empty = Mailbox::empty;
  if (!mailbox.compare_exchange_strong(empty, Mailbox::claimed, std::memory_order_acq_rel)) return;
  reported = {.who = who, .lasted = lasted};
  mailbox.store(Mailbox::full, std::memory_order_release);
}

std::optional<ProcessorGuard::Taker> ProcessorGuard::take() noexcept {
  Mailbox full = Mailbox::full;
  if (!mailbox.compare_exchange_strong(full, Mailbox::claimed, std::memory_order_acq_rel))
    return std::nullopt;
  const Taker taken = reported;
  mailbox.store(Mailbox::empty, std::memory_order_release);
  return taken;
}

}  // namespace plchost
