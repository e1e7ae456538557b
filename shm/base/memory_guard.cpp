#include "shm/base/memory_guard.hpp"

#include <signal.h>
#include <sys/mman.h>

namespace plchost {

// Static, so that a signal handler finds it whatever the process is at.
constinit std::array<MemoryGuard::Slot, MemoryGuard::kMost> MemoryGuard::slots;

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

void MemoryGuard::watch_process() noexcept {
  struct sigaction action{};
  action.sa_flags = SA_SIGINFO;
  action.sa_sigaction = [](int signal, siginfo_t* info, void*) {
    // Of what is not guarded the next touch is the end.
    if (info->si_code <= 0 || !mend(info->si_addr)) ::signal(signal, SIG_DFL);
  };
  ::sigaction(SIGBUS, &action, nullptr);
}

bool MemoryGuard::mend(const void* address) noexcept {
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  for (Slot& slot : slots) {
    const std::uintptr_t end = slot.end.load(std::memory_order_acquire);
    const std::uintptr_t begin = slot.begin.load(std::memory_order_relaxed);
    if (at < begin || at >= end) continue;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): it is an address
    void* const memory = reinterpret_cast<void*>(begin);
    const void* const zeros =
        ::mmap(memory, end - begin, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
    if (zeros == MAP_FAILED) return false;
    slot.lost.store(true, std::memory_order_relaxed);
    return true;
  }
  return false;
}

}  // namespace plchost
