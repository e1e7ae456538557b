#include "shm/guard/memory_guard.hpp"

#include <algorithm>
#include <mutex>

#include <signal.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace plchost {

// Static, so that a signal handler finds it whatever the process is at.
constinit std::array<MemoryGuard::Slot, MemoryGuard::kMost> MemoryGuard::slots;
constinit std::atomic<bool> MemoryGuard::lost_any{false};

MemoryGuard::MemoryGuard(std::span<std::byte> memory) noexcept {
  const auto begin = reinterpret_cast<std::uintptr_t>(memory.data());
  for (Slot& slot : slots) {
    std::uintptr_t free = 0;
    if (!slot.begin.compare_exchange_strong(free, begin, std::memory_order_acq_rel)) continue;
    slot_.reset(&slot);
    slot.end.store(begin + memory.size(), std::memory_order_release);
    return;
  }
}

void MemoryGuard::Release::operator()(Slot* slot) const noexcept {
  slot->end.store(0, std::memory_order_relaxed);
  slot->lost.store(false, std::memory_order_relaxed);
  slot->begin.store(0, std::memory_order_release);
}

namespace {

struct sigaction handler_before{};  // written before ours is there

// As if there were no handler of ours. A fault comes back by itself; a signal that was sent is sent again.
void hand_on(int signal, siginfo_t* info, void* context) noexcept {
  if ((handler_before.sa_flags & SA_SIGINFO) != 0) return handler_before.sa_sigaction(signal, info, context);
  const bool sent = info->si_code <= 0;
  if (handler_before.sa_handler == SIG_IGN && sent) return;
  if (handler_before.sa_handler != SIG_DFL && handler_before.sa_handler != SIG_IGN) {
    return handler_before.sa_handler(signal);
  }
  ::signal(signal, SIG_DFL);
  if (sent) ::syscall(SYS_tgkill, ::getpid(), ::gettid(), signal);
}

void on_bus_error(int signal, siginfo_t* info, void* context) noexcept {
  if (info->si_code != BUS_ADRERR || !MemoryGuard::mend(info->si_addr)) hand_on(signal, info, context);
}

}  // namespace

void MemoryGuard::watch_process() noexcept {
  static std::once_flag once;
  std::call_once(once, [] {
    struct sigaction action{};
    action.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_RESTART;
    action.sa_sigaction = on_bus_error;
    ::sigaction(SIGBUS, nullptr, &handler_before);
    ::sigaction(SIGBUS, &action, nullptr);
  });
}

void MemoryGuard::watch_thread() noexcept {
  thread_local bool watched = false;
  if (watched) return;
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGBUS);
  ::pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
  watched = true;
}

bool MemoryGuard::is_lost(const void* address) noexcept {
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  return std::ranges::any_of(slots, [at](const Slot& slot) {
    const std::uintptr_t end = slot.end.load(std::memory_order_acquire);
    const std::uintptr_t begin = slot.begin.load(std::memory_order_relaxed);
    return at >= begin && at < end && slot.lost.load(std::memory_order_relaxed);
  });
}

// The touch may be an atomic access. The thread sanitizer makes those under a lock of its own. It takes that
// lock for any access that acquires or releases, and for mmap() of the C library: here for ever. So fences
// order the accesses, and the kernel is called directly.
bool MemoryGuard::mend(const void* address) noexcept {
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  for (Slot& slot : slots) {
    const std::uintptr_t end = slot.end.load(std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_acquire);
    const std::uintptr_t begin = slot.begin.load(std::memory_order_relaxed);
    if (at < begin || at >= end) continue;
    constexpr int kZeros = MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED;
    if (::syscall(SYS_mmap, begin, end - begin, PROT_READ | PROT_WRITE, kZeros, -1, 0) == -1) return false;
    slot.lost.store(true, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    lost_any.store(true, std::memory_order_relaxed);
    return true;
  }
  return false;
}

}  // namespace plchost
