#include "schedulers/faults/processor_guard.hpp"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>

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
constinit std::atomic<pid_t> signer{0};  // who gave it
constinit std::atomic<Mailbox> mailbox{Mailbox::empty};
constinit ProcessorGuard::Taker reported;  // belongs to who has made the mailbox `claimed` or found it `full`

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

// In the thread that has run for so long, unless it blocks the signal: then in any other.
void on_long_run(int) noexcept {
  const int saved = errno;
  const Duration limit(guard_limit.load(std::memory_order_relaxed));
  const Duration silent =
      MonotonicClock::now() - TimePoint(Duration(last_sign.load(std::memory_order_relaxed)));
  constexpr int kSigns = 4;  // at least so many belong into the limit
  // A thread that sleeps is kept from its sign by something else.
  const bool starved = limit > Duration::zero() && silent > limit / kSigns &&
                       !linux_processor_times().sleeps(signer.load(std::memory_order_relaxed));
  // How long a cycle may take is for the watchdogs to say.
  if (starved && !FaultTrap::armed_here()) {
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
  if (const auto set = check_errno(::sigaction(SIGXCPU, &action, nullptr), "catch SIGXCPU"); !set)
    return std::unexpected(set.error());
  guarded.store(true, std::memory_order_release);
  return {};
}

void ProcessorGuard::watch(Duration limit) noexcept {
  if (!guarded.load(std::memory_order_acquire)) return;
  guard_limit.store(limit.count(), std::memory_order_relaxed);
  alive();
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
